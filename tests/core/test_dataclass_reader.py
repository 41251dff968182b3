from dataclasses import dataclass, field
from typing import ClassVar, Literal

import pytest

from jaxphys.core.dataclass_reader import from_json
from jaxphys.core.errors import InputError
from jaxphys.core.fields import between


@dataclass(frozen=True)
class Round:
    type: ClassVar[str] = "round"
    radius: float


@dataclass(frozen=True)
class Square:
    type: ClassVar[str] = "square"
    side: float


@dataclass(frozen=True)
class Thing:
    name: str
    count: int = field(default=1, metadata=between(0, 1000) | {"keys": ("cuont", "count")})
    shape: Round | Square | None = None
    place: tuple[float, float] = (0.0, 0.0)
    parts: tuple[Round, ...] = ()
    sizes: int | tuple[int, ...] = 3
    numbers: dict[str, float] = field(default_factory=dict)
    kind: Literal["a", "b"] = "a"
    flag: bool = False
    ours: object = field(default=None, metadata={"keys": ()})

    def __post_init__(self):
        if self.name == "bad":
            raise InputError("name: is bad")


def test_every_kind_of_field():
    value = {
        "name": "x", "cuont": 1e2, "shape": {"type": "square", "side": 2}, "place": [1, 2.5],
        "parts": [{"radius": 1}], "sizes": [1, 2], "numbers": {"e": 1}, "kind": "b", "flag": True,
    }  # fmt: skip
    assert from_json(Thing, value, "f") == Thing(
        "x", 100, Square(2.0), (1.0, 2.5), (Round(1.0),), (1, 2), {"e": 1.0}, "b", True
    )
    assert from_json(Thing, {"name": "x", "sizes": 5, "shape": None}, "f") == Thing("x", sizes=5)


def test_of_several_keys_the_last_one_counts():
    assert from_json(Thing, {"name": "x", "count": 3, "cuont": 2}, "f").count == 3


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"name": None}, "f.name: expected a text, found None"),
        ({"name": "a\0"}, "f.name: expected a text of whole characters"),
        ({"name": "\ud800"}, "f.name: expected a text of whole characters"),
        ({"name": "bad"}, "f.name: is bad"),
        ({"count": 10**400}, r"f.count: .* must be at most 1000"),
        ({"cuont": -1}, "f.cuont: -1 must be at least 0"),
        ({"count": 1.5}, "f.count: expected a whole number, found 1.5"),
        ({"count": True}, "f.count: expected a whole number"),
        ({"place": [1e16, 0]}, r"f.place\[0\]: .* must be at most 1e\+15"),
        ({"place": [float("nan"), 0]}, r"f.place\[0\]: nan is not a finite number"),
        ({"place": [0]}, "f.place: expected a list of 2 values"),
        ({"parts": [{"radius": 1}] * 20_000}, "f.parts: 20000 entries, more than 10000"),
        ({"parts": [{"radius": "1"}]}, r"f.parts\[0\].radius: expected a number, found '1'"),
        ({"sizes": "1"}, "f.sizes: expected a whole number"),
        ({"sizes": ["1"]}, r"f.sizes\[0\]: expected a whole number"),
        ({"shape": {"type": "rond"}}, r"f.shape.type: unknown type 'rond'; did you mean 'round'"),
        ({"shape": {"type": []}}, "f.shape: the key 'type' is missing"),
        ({"shape": {"type": "round"}}, "f.shape: the key 'radius' is missing"),
        ({"numbers": {"e": None}}, "f.numbers.e: expected a number"),
        ({"kind": ["a"]}, r"f.kind: unknown value \['a'\]; "),
        ({"flag": 1}, "f.flag: expected true or false, found 1"),
        ({"cont": 1}, "f: unknown key 'cont'; did you mean 'cuont' or 'count'"),
        ({"ours": 1}, "f: unknown key 'ours'"),
        ({"\x1b[31m" + "x" * 1000: 1}, r"f: unknown key '\\x1b\[31m.* valid: "),
    ],
)
def test_what_is_wrong_is_named(change, message):
    with pytest.raises(InputError, match=f"^{message}") as error:
        from_json(Thing, {"name": "x"} | change, "f")
    assert str(error.value).isprintable() and len(str(error.value)) <= 300


def test_a_place_that_ends_in_a_space_is_a_file():
    with pytest.raises(InputError, match=r"^a.json: count: 2000 must"):
        from_json(Thing, {"name": "x", "count": 2000}, "a.json: ")
    with pytest.raises(InputError, match=r"^a.json: the key 'name' is missing"):
        from_json(Thing, {}, "a.json: ")


def test_unknown_keys_may_be_told_to_somebody():
    seen = {}
    from_json(Thing, {"name": "x", "z": 1}, "f", unknown=seen.__setitem__)
    assert seen == {"z": 1}
