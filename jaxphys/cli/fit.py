"""`jaxphys fit`."""

from pathlib import Path

from tyro.conf import Positional


def fit(
    config: Positional[Path],
    /,
    *,
    out: Path,
    overwrite: bool = False,
    quiet: bool = False,
    json: bool = False,
) -> int:
    """Find what something is made of, and how it was thrown, from how it moved.

    For example: jaxphys fit fit.json --out outputs/fit

    Args:
        config: What moves (a scene's file), what is free of it, and what was observed; for example
            {"scene": "scene.json", "free": {"youngs_modulus": {"type": "log", "start": 2e4}},
            "observed": [{"type": "tracks", "file": "tracks.npz"}]}.
        out: Directory for the results: new, empty, or of an earlier run. An interrupted fit goes
            on by the same command.
        overwrite: Replace the files of an earlier run of another request, and only these.
        quiet: Show no progress.
        json: Print result.json.
    """
    from jaxphys.pipeline.fit import fit_file

    found = fit_file(config, out, overwrite=overwrite, progress=not quiet)
    print((out / "result.json").read_text().rstrip() if json else found)
    return 0
