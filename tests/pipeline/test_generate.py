import dataclasses
import json
import threading
from http.server import BaseHTTPRequestHandler, HTTPServer

import numpy as np
import pytest

import jaxphys.guidance.bundled.priors as priors
import jaxphys.guidance.choice as choice
import jaxphys.guidance.optimise as optimise
from jaxphys.core.errors import InputError
from jaxphys.gaussians.gaussians import from_points
from jaxphys.gaussians.ply import write_ply
from jaxphys.guidance.prompts.refine import Refinement
from jaxphys.pipeline import generate as generate_module
from jaxphys.pipeline import saving
from jaxphys.pipeline.generate import generate
from jaxphys.scene import Domain, MeshObstacle, Object, Scene, read_scene

SCENE = Scene(
    objects=(
        Object(parameters={"youngs_modulus": 2e3}, size=0.4, centre=(0.5, 0.5, 0.5), filling=None),
    ),
    domain=Domain((1.0, 1.0, 1.0), 1 / 14),
    frames=2,
    frame_time=0.01,
    width=32,
    height=24,
)


@pytest.fixture
def calls(monkeypatch):
    """Stands in for the optimisation, which has tests of its own; records what it is asked."""
    asked = []

    def made(prompt, **options):
        config = options["config"]
        asked.append((prompt, options["seed"], config.steps, config.count))
        points = np.random.default_rng(options["seed"]).normal(size=(40, 3))
        return from_points(points.astype(np.float32), np.full(3, 0.5), 0.3)

    monkeypatch.setattr(optimise, "text_to_gaussians", made)
    monkeypatch.setattr(choice, "guides", lambda prompt, **options: None)
    monkeypatch.delenv("JAXPHYS_LLM_URL", raising=False)
    return asked


def test_prompt_is_refined_recorded_and_repeatable(calls, tmp_path):
    out = generate("a strawberry", SCENE, tmp_path / "a", steps=3, splats=40)
    prompt = json.loads((out / "prompt.json").read_text())
    assert prompt["original"] == "a strawberry" and prompt["how"].startswith("offline")
    assert calls[0][0] == prompt["refined"]
    assert calls[0][1:] == (0, 3, 40)
    again = generate(None, read_scene(out / "config.json").scene, tmp_path / "b")
    assert calls[1] == calls[0]
    for name in ("prompt.json", "config.json", "gaussians.ply", "motion.mp4", "metrics.jsonl"):
        assert (again / name).read_bytes() == (out / name).read_bytes()


def test_an_interrupted_run_keeps_the_object(calls, tmp_path):
    def interrupt(stage, frame):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        generate("a can", SCENE, tmp_path, watch=interrupt)
    generate("a can", SCENE, tmp_path)
    assert len(calls) == 1
    generate("a can", dataclasses.replace(SCENE, seed=1), tmp_path, overwrite=True)
    assert len(calls) == 2


def test_unusable_prompts_leave_nothing(calls, tmp_path):
    for prompt in ("", None):
        with pytest.raises(InputError, match=r"^prompt: "):
            generate(prompt, SCENE, tmp_path / "out")
    assert not calls and not (tmp_path / "out").exists()


def test_missing_weights_are_said_before_anything_is_written(tmp_path, monkeypatch):
    monkeypatch.setattr(priors.weights, "manifest", lambda: {"text_encoder": {}, "point_prior": {}})
    with pytest.raises(InputError, match="without the weights pixel_prior"):
        generate("a strawberry", Scene(), tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_an_endpoint_s_answer_reaches_the_video(tmp_path, monkeypatch):
    """With the bundled priors themselves; the key stays out of every file."""
    content = "a strawberry, red heart-shaped fruit, small yellow seeds, green leafy cap"
    key = "secret-key-0123456789"

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self):
            self.send_response(200)
            self.end_headers()
            self.wfile.write(json.dumps({"choices": [{"message": {"content": content}}]}).encode())

        def log_message(self, *_):
            """Silent."""

    server = HTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True)
    thread.start()
    monkeypatch.setenv("JAXPHYS_LLM_URL", f"http://127.0.0.1:{server.server_port}/v1")
    monkeypatch.setenv("JAXPHYS_LLM_KEY", key)
    try:
        out = generate("a strawberry", SCENE, tmp_path / "run", steps=0, splats=60)
    finally:
        server.shutdown()
        server.server_close()
        thread.join()
    prompt = json.loads((out / "prompt.json").read_text())
    assert prompt["refined"] == content == prompt["answer"] and prompt["how"] == "endpoint (gpt-4)"
    assert "Context:" in prompt["instruction"] and prompt["attempts"] == []
    assert (out / "motion.mp4").stat().st_size > 0
    files = [path for path in out.rglob("*") if path.is_file()]
    assert len(files) > 4 and not any(key.encode() in path.read_bytes() for path in files)


def test_an_unfinished_run_keeps_its_prompt(calls, tmp_path, monkeypatch):
    """A language model may answer otherwise the second time; the run would begin anew."""

    def interrupt(stage, frame):
        raise KeyboardInterrupt

    monkeypatch.setattr(generate_module, "refine", lambda p, how: Refinement(p, "first", "test"))
    with pytest.raises(KeyboardInterrupt):
        generate("a can", SCENE, tmp_path, watch=interrupt)
    monkeypatch.setattr(generate_module, "refine", lambda p, how: Refinement(p, "second", "test"))
    generate("a can", SCENE, tmp_path)
    assert [prompt for prompt, *_ in calls] == ["first"]
    generate("a can", SCENE, tmp_path)
    assert json.loads((tmp_path / "prompt.json").read_text())["refined"] == "second"


@pytest.fixture
def unfinished(calls, tmp_path):
    """The folder of a run that was interrupted when its object had been made."""

    def interrupt(stage, frame):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        generate("a can", SCENE, tmp_path / "out", watch=interrupt)
    calls.clear()
    return tmp_path / "out"


def flip(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 4
    path.write_bytes(content)


def test_another_refiner_is_another_request(calls, unfinished):
    with pytest.raises(InputError, match="another request"):
        generate("a can", SCENE, unfinished, refiner="rules")
    out = generate("a can", SCENE, unfinished, refiner="rules", overwrite=True)
    assert len(calls) == 1
    assert json.loads((out / "config.json").read_text())["generation"]["refiner"] == "rules"


@pytest.mark.parametrize("name", ["object.ply", "prompt.json"])
def test_what_was_kept_and_is_damaged_is_made_again_and_said(calls, unfinished, capsys, name):
    flip(unfinished / "checkpoint" / name)
    out = generate("a can", SCENE, unfinished)
    assert len(calls) == (name == "object.ply")
    assert f"{name}: is not used, its SHA-256 differs" in capsys.readouterr().err
    assert json.loads((out / "prompt.json").read_text())["original"] == "a can"
    again = generate("a can", SCENE, unfinished.parent / "again")
    for name in ("prompt.json", "gaussians.ply", "motion.mp4"):
        assert (again / name).read_bytes() == (out / name).read_bytes()


def test_an_optimisation_goes_on_where_it_was_interrupted(calls, tmp_path, monkeypatch):
    """Every step's state is `step` ones; a damaged checkpoint gives way to the one before."""
    seen = []

    def made(prompt, *, config, resume, on_step, **options):
        state = optimise.start(from_points(np.zeros((40, 3), np.float32), np.zeros(3), 1.0), config)
        first = 0 if resume is None else int(resume.step)
        seen.append(first)
        for step in range(first + 1, config.steps + 1):
            on_step(state._replace(step=np.int32(step), pull=np.full(state.pull.shape, step)))
            if step == 5 and len(seen) == 1:
                raise KeyboardInterrupt
        return from_points(np.full((40, 3), seen[-1], np.float32), np.full(3, 0.5), 0.3)

    monkeypatch.setattr(optimise, "text_to_gaussians", made)
    monkeypatch.setattr(saving, "SAVE_EVERY", -1.0)  # after each step
    options = {"steps": 6, "splats": 40}
    with pytest.raises(KeyboardInterrupt):
        generate("a can", SCENE, tmp_path, **options)
    steps = tmp_path / "checkpoint/object"
    assert sorted(path.name for path in steps.iterdir()) == ["4", "5"]
    flip(next(path for path in sorted((steps / "5").rglob("*")) if path.is_file()))
    generate("a can", SCENE, tmp_path, **options)
    assert seen == [0, 4] and not (tmp_path / "checkpoint").exists()


def test_the_library_makes_the_object_without_a_prior(calls, tmp_path):
    made = generate("a blue mug", SCENE, tmp_path, prior="library", splats=300)
    prompt = json.loads((made / "prompt.json").read_text())
    assert not calls
    assert prompt["original"] == "a blue mug"
    assert prompt["made_by"]["prior"] == "library" and prompt["made_by"]["kind"] == "mug"
    assert prompt["made_by"]["colours"]["body"] == "blue"


def test_what_the_library_lacks_is_said_before_any_work(calls, tmp_path):
    with pytest.raises(InputError, match=r"pangolin.*nearest are .*--prior stable-diffusion"):
        generate("a pangolin", SCENE, tmp_path / "new", prior="library")
    assert not (tmp_path / "new").exists()
    with pytest.raises(InputError, match="shape_prior"):
        generate("a mug", SCENE, tmp_path / "new", prior="library", shape_prior="point-e")


def test_what_the_priors_never_saw_is_told_and_tried(calls, tmp_path, capsys):
    generate("a pangolin", SCENE, tmp_path)
    assert "pangolin" in capsys.readouterr().err and len(calls) == 1
    generate("a can", SCENE, tmp_path, overwrite=True)
    assert capsys.readouterr().err == ""


def test_other_objects_and_obstacles_are_read_from_beside_the_scene(calls, tmp_path, monkeypatch):
    """Before anything is generated: what is missing is told at once."""
    (tmp_path / "scene").mkdir()
    points = np.random.default_rng(1).normal(size=(30, 3)).astype(np.float32)
    write_ply(tmp_path / "scene/other.ply", from_points(points, np.full(3, 0.5), 0.3))
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
    (tmp_path / "scene/peg.obj").write_text(corners + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    (thing,) = SCENE.objects
    made = dataclasses.replace(thing, size=0.25, centre=(0.3, 0.5, 0.5))
    other = dataclasses.replace(made, source="other.ply", centre=(0.7, 0.5, 0.5))
    peg = MeshObstacle((0.5, 0.5, 0.2), source="peg.obj", size=0.1, resolution=8)
    scene = dataclasses.replace(SCENE, objects=(made, other), boundaries=(peg,), frames=1)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=r"other\.ply: no such file"):
        generate("a strawberry", scene, "none", steps=3, splats=40)
    assert not calls
    out = generate("a strawberry", scene, "out", beside=tmp_path / "scene", steps=3, splats=40)
    assert (out / "gaussians_1.ply").read_bytes() == (tmp_path / "scene/other.ply").read_bytes()
    assert (out / "obstacle_0.ply").exists() and (out / "gaussians.ply").exists()
