"""What changes the picture's definition or the program, never a gradient."""

from dataclasses import dataclass, replace

from jaxphys.core.errors import InputError, nearest

EXTENTS = ("alpha", "three_sigma")
JACOBIAN_CLAMPS = ("principal", "symmetric", "none")

# Edge of the tiles that bound a splat in the original implementation, whatever our own tiles are.
REFERENCE_TILE = 16


@dataclass(frozen=True)
class Settings:
    """Conventions of the rasteriser. Frozen and hashable: a change of any field compiles anew.

    Attributes:
        tile_size: edge of a square tile [pixels]. Changes speed, not the picture.
        near, far: a splat is drawn where near < z < far [m].
        low_pass: added to both variances of every projected splat [pixels^2] (EWA, Zwicker et al.
            2001).
        antialias: multiply opacity by sqrt(det / det_blurred), so that the low-pass keeps a small
            splat's total instead of brightening it (Yu et al. 2024, Mip-Splatting, eq. 10).
        alpha_min: smaller contributions are skipped, as in Kerbl et al. 2023 (1/255).
        alpha_max: larger contributions are clamped; below 1.
        transmittance_min: a pixel is finished before the splat that would bring it below this.
        extent: "alpha" draws a splat wherever its alpha reaches `alpha_min`; "three_sigma" draws it
            in those tiles of 16 pixels that meet its circle of three standard deviations, which is
            what Kerbl et al. 2023 do and drops contributions of up to 1.1 % outside.
        jacobian_clamp: how far off axis the projection is still linearised at the mean itself:
            "principal" 15 % of the picture beyond each border (gsplat), "symmetric" 1.3 times the
            half field of view about the optical axis (Kerbl et al. 2023), "none".
        gradient_through_clamp: pass the gradient of alpha through the clamp at `alpha_max`, as
            Kerbl et al. 2023 do; the true derivative there is zero, which is the default.
        depth: whether `Image.depth` is worked out; without it a number less is blended a splat.
        chunk_size, group_size: how the blending loop is cut up: so many splats of a tile at a time,
            for so many tiles at a time. `group_size` None takes what suits the tile. Speed only.
        devices: so many, the first of `jax.devices()`, share the rows of tiles of one picture. For
            a large picture by itself; several pictures are better drawn side by side
            (`jaxphys.over_devices`), within which this must be 1.
    """

    tile_size: int = 8
    near: float = 0.01
    far: float = 1e10
    low_pass: float = 0.3
    antialias: bool = False
    alpha_min: float = 1.0 / 255.0
    alpha_max: float = 0.99
    transmittance_min: float = 1e-4
    extent: str = "alpha"
    jacobian_clamp: str = "principal"
    gradient_through_clamp: bool = False
    depth: bool = True
    chunk_size: int = 8
    group_size: int | None = None
    devices: int = 1

    def __post_init__(self):
        def require(holds: bool, field: str, remedy: str) -> None:
            if not holds:
                raise InputError(f"Settings.{field} = {getattr(self, field)!r}: {remedy}")

        for field, names in (("extent", EXTENTS), ("jacobian_clamp", JACOBIAN_CLAMPS)):
            value = getattr(self, field)
            require(value in names, field, nearest(str(value), names))
        require(self.tile_size >= 1, "tile_size", "must be at least 1 pixel")
        require(
            self.extent == "alpha" or REFERENCE_TILE % self.tile_size == 0,
            "tile_size",
            f"must divide {REFERENCE_TILE} with extent='three_sigma'",
        )
        require(self.near >= 1e-6, "near", "must be at least 1e-6 m")
        require(self.far > self.near, "far", "must be larger than near")
        require(self.low_pass >= 1e-3, "low_pass", "must be at least 1e-3 pixels^2")
        require(0 < self.alpha_max < 1, "alpha_max", "must lie between 0 and 1, both excluded")
        require(
            0 < self.alpha_min < self.alpha_max, "alpha_min", "must lie between 0 and alpha_max"
        )
        require(0 <= self.transmittance_min < 1, "transmittance_min", "must lie in [0, 1)")
        require(self.chunk_size >= 1, "chunk_size", "must be at least 1")
        require(self.devices >= 1, "devices", "must be at least 1")
        require(self.group_size is None or self.group_size >= 1, "group_size", "must be at least 1")

    @classmethod
    def inria(cls, **changes) -> "Settings":
        """The conventions of Kerbl et al. 2023 (diff-gaussian-rasterization)."""
        base = cls(
            near=0.2,
            extent="three_sigma",
            jacobian_clamp="symmetric",
            gradient_through_clamp=True,
        )
        return replace(base, **changes)

    @classmethod
    def gsplat(cls, **changes) -> "Settings":
        """The conventions of gsplat 1.5.3 (Ye et al. 2024), whose alpha_max is 0.999."""
        return replace(cls(alpha_max=0.999), **changes)
