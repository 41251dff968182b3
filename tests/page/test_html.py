"""Pages hold what users wrote as text, and ask for nothing."""

import html.parser
import json
import re

import pytest

from jaxphys.page.curves import curves, ticks
from jaxphys.page.html import as_data, bundled, data_element, document
from jaxphys.page.report import Told, report_page
from jaxphys.page.videos import videos_page
from tests.page.moving import entry

NASTY = "</script><script>alert(1)</script><img src=x onerror=alert(2)>\"'&"


class Elements(html.parser.HTMLParser):
    """Elements with their attributes, and text."""

    def __init__(self, page):
        super().__init__()
        self.found, self.text = [], ""
        self.feed(page)

    def handle_starttag(self, tag, attributes):
        self.found.append((tag, dict(attributes)))

    def handle_data(self, data):
        self.text += data


def report(title="a ball"):
    rows = [
        {
            "time": t / 24,
            "mass": 2.0,
            "centre_of_mass": [0, 0, 1 - t / 10],
            "momentum": [0, 0, -t],
            "kinetic_energy": float(t),
            "pieces": 1 + t,
        }
        for t in range(5)
    ]
    facts = {title: title}
    return report_page(Told(title, facts, rows, (0, 0, -9.81), title, [title]))


@pytest.mark.parametrize(
    "page",
    [videos_page([entry(title=NASTY, facts={NASTY: NASTY})], title=NASTY), report(NASTY)],
    ids=["videos", "report"],
)
def test_what_users_wrote_stays_text(page):
    seen = Elements(page)
    assert not [tag for tag, given in seen.found if any(name.startswith("on") for name in given)]
    assert "onerror=alert(2)" in seen.text and "x" not in [g.get("src") for _, g in seen.found]
    scripts = [given for tag, given in seen.found if tag == "script"]
    run = [given for given in scripts if given.get("type") is None]
    assert len(run) == (1 if "data-card" in page else 0)
    assert not any("src" in given for given in scripts)


@pytest.mark.parametrize("page", [videos_page([entry()]), report()], ids=["videos", "report"])
def test_a_page_names_no_address_and_its_policy_lets_nothing_out(page):
    assert not re.search(r"(?i)(https?|wss?|ftp)://|//[a-z0-9-]+\.[a-z]", page)
    assert not re.search(r"\b(fetch|XMLHttpRequest|WebSocket|EventSource|sendBeacon)\b", page)
    (policy,) = [
        given["content"]
        for tag, given in Elements(page).found
        if tag == "meta" and given.get("http-equiv") == "Content-Security-Policy"
    ]
    assert policy.startswith("default-src 'none'; ") and "connect-src" not in policy
    assert "unsafe" not in policy and "*" not in policy


def test_data_cannot_end_its_element():
    assert json.loads(as_data({"a": NASTY})) == {"a": NASTY}
    assert "<" not in as_data(NASTY)
    with pytest.raises(ValueError, match="could end"):
        data_element("a", "application/json", NASTY)
    with pytest.raises(ValueError, match="end its own element"):
        document("a", "", script=NASTY)


def test_what_comes_with_the_package_is_there():
    assert all(bundled(name) for name in ("player.js", "page.css", "card.html"))


def test_curves_show_every_value_inside_the_frame():
    drawn = curves([0.0, 1.0, 2.0], {"<a>": [1.0, float("nan"), 3.0]}, "J", "E & <b>")
    points = re.search(r'polyline points="([^"]*)"', drawn)[1].split()
    places = [tuple(map(float, point.split(","))) for point in points]
    assert len(places) == 2 and places[0][1] > places[1][1]
    assert "&lt;a&gt;" in drawn and "E &amp; &lt;b&gt;" in drawn and "<b>" not in drawn
    for flat in ([], [0.0, 0.0, 0.0], [5e30, 5e30, 5e30]):
        text = curves([0.0, 1.0, 2.0][: len(flat)], {"a": flat}, "J", "E")
        assert "nan" not in text and "inf" not in text
    assert ticks(-1.0, 1.0) == pytest.approx([-1, -0.5, 0, 0.5, 1])
