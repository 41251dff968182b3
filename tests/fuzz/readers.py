"""Each reader with a small valid file of its own, and the ways in which that is spoiled."""

import gzip
import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from random import Random
from typing import NamedTuple

import gguf
import ml_dtypes
import numpy as np
import trimesh
from PIL import Image
from safetensors.numpy import save_file
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from jaxphys.cli.scenes import scene_for
from jaxphys.evaluate.report import find_prompt
from jaxphys.export import write_compressed_ply, write_spz
from jaxphys.gaussians.gaussians import from_points
from jaxphys.gaussians.ply import write_ply
from jaxphys.gaussians.splat_file import write_splat
from jaxphys.guidance.published.scheduler_config import SchedulerConfig
from jaxphys.networks.clip_config import TextConfig
from jaxphys.networks.clip_tokenizer import ClipTokenizer
from jaxphys.networks.llama_config import LlamaConfig
from jaxphys.networks.unet import UNetConfig
from jaxphys.scene.json import to_json
from jaxphys.scene.scene import Object, Region, Rotation, Scene
from jaxphys.scene.source import load
from jaxphys.weights.gguf_file import read_gguf
from jaxphys.weights.gguf_tokenizer import tokenizer_from_gguf
from jaxphys.weights.safetensors_files import open_arrays
from jaxphys.weights.torch_zip import read_torch_zip
from tests.fuzz import mutations

UNIT = (1.0, 1.0, 1.0)
STATE = Path(__file__).parents[1] / "weights" / "golden" / "state.pt"
PHYSGAUSSIAN = {
    "opacity_threshold": 0.02, "rotation_degree": [90.0], "rotation_axis": [0],
    "substep_dt": 1e-4, "frame_dt": 1e-2, "frame_num": 100, "E": 2e6, "nu": 0.4,
    "material": "jelly", "density": 200, "g": [0, 0, -9.8], "grid_lim": 2, "n_grid": 20,
    "sim_area": [-1, 1, -1, 1, -1, 1], "scale": 1.0, "grid_v_damping_scale": 0.9999,
    "additional_material_params": [{"point": [1, 1, 1], "size": [0.1, 0.1, 0.1], "E": 1e5,
                                    "nu": 0.3, "density": 100}],
    "particle_filling": {"n_grid": 10, "density_threshold": 5.0, "search_threshold": 3.0,
                         "max_particles_num": 1000, "max_partciels_per_cell": 1,
                         "search_exclude_direction": 5, "ray_cast_direction": 4,
                         "boundary": [0, 1, 0, 1, 0, 1], "smooth": False},
    "boundary_conditions": [
        {"type": "bounding_box"},
        {"type": "cuboid", "point": [1, 1, 1], "size": [0.2, 0.2, 0.2], "velocity": [0, 0, 0],
         "start_time": 0, "end_time": 1e3, "reset": 1},
        {"type": "particle_impulse", "force": [0, 0, 1], "num_dt": 10},
        {"type": "surface_collider", "point": [1, 1, 0.1], "normal": [0, 0, 1],
         "surface": "slip", "friction": 0.1},
        {"type": "enforce_particle_velocity_rotation", "normal": [0, 0, 1], "point": [1, 1, 1],
         "half_height_and_radius": [0.1, 0.2], "rotation_scale": 1.0, "translation_scale": 0.0,
         "start_time": 0, "end_time": 1},
    ],
    "mpm_space_viewpoint_center": [1, 1, 1], "mpm_space_vertical_upward_axis": [0, 0, 1],
    "default_camera_index": -1, "show_hint": False, "init_azimuthm": 10, "init_elevation": 5,
    "init_radius": 2, "move_camera": True, "delta_a": 0.1, "delta_e": 0.1, "delta_r": 0.1,
}  # fmt: skip
LLAMA = {
    "model_type": "llama", "vocab_size": 300, "hidden_size": 64, "intermediate_size": 96,
    "num_hidden_layers": 2, "num_attention_heads": 4, "num_key_value_heads": 2,
}  # fmt: skip


class Case(NamedTuple):
    """`file` of a folder is spoiled by `mutate(content, random)`, then `read(path)` is called with
    the folder or, if `whole` is not set, with the file."""

    file: str
    write: Callable[[Path], None]
    mutate: tuple[Callable[[bytes, Random], bytes], ...]
    read: Callable[[Path], object]


def _splats(path: Path) -> None:
    points = np.random.default_rng(0).normal(size=(4, 3)).astype(np.float32)
    write_ply(path, from_points(points, np.full(3, 0.5), 0.1))


def _ascii_splats(path: Path) -> None:
    _splats(path)
    header, table = path.read_bytes().split(b"end_header\n")
    rows = np.frombuffer(table, "<f4").reshape(4, -1)
    lines = [" ".join(f"{value:g}" for value in row) for row in rows]
    text = header.decode().replace("binary_little_endian", "ascii") + "end_header\n"
    path.write_text(text + "\n".join(lines) + "\n")


def _harmonics(path: Path) -> None:
    """A compressed .ply or an .spz with harmonics."""
    points = np.random.default_rng(0).normal(size=(4, 3)).astype(np.float32)
    gaussians = from_points(points, np.full(3, 0.5), 0.1, degree=1)
    (write_spz if path.suffix == ".spz" else write_compressed_ply)(path, gaussians)


def _splat(path: Path) -> None:
    points = np.random.default_rng(0).normal(size=(4, 3)).astype(np.float32)
    write_splat(path, from_points(points, np.full(3, 0.5), 0.1))


def _unzipped(data: bytes, random: Random) -> bytes:
    return gzip.compress(BYTES(gzip.decompress(data), random))


def _textured() -> trimesh.Trimesh:
    box = trimesh.creation.box()
    material = PBRMaterial(baseColorTexture=Image.new("RGB", (4, 4), (9, 99, 255)))
    box.visual = TextureVisuals(uv=np.random.default_rng(0).random((8, 2)), material=material)
    return box


def _mesh(path: Path) -> None:
    path.write_bytes(trimesh.creation.box().export(file_type=path.suffix[1:]))


def _text_mesh(path: Path) -> None:
    text = trimesh.creation.box().export(file_type=path.suffix[1:].replace("stl", "stl_ascii"))
    path.write_text(text)


def _glb(path: Path) -> None:
    path.write_bytes(trimesh.Scene(_textured()).export(file_type="glb"))


def _obj(path: Path) -> None:
    path.write_text(
        "mtllib m.mtl\nv 0 0 0\nv 1 0 0 0.5 0.5 1\nv 0 1 0\nv 0 0 1\nvn 0 0 1\nvt 0 0\nvt 1 0\n"
        "vt 0 1\no a\nusemtl m\nf 1/1/1 2/2/1 3/3/1\nf 1/1 2/2 4/3\ng b\nf 1 3 4\nf 2 3 4\n"
    )
    (path.parent / "m.mtl").write_text("newmtl m\nKd 1 0 0\nd 1.0\nmap_Kd p.png\n")
    Image.new("RGBA", (4, 4), (9, 99, 255, 255)).save(path.parent / "p.png")


def _scene(path: Path) -> None:
    from tests.scene.test_json import FULL

    path.write_text(json.dumps(to_json(FULL)))


def _default_scene(path: Path) -> None:
    thing = Object(regions=(Region(UNIT, UNIT, {"density": 3.0}),), rotation=(Rotation(UNIT, 3.0),))
    path.write_text(json.dumps(to_json(Scene(objects=(thing,)))))


def _json(value: dict, path: Path) -> None:
    path.write_text(json.dumps(value))


def _arrays(path: Path) -> None:
    save_file(
        {
            "a": np.arange(6, dtype=np.float32).reshape(2, 3),
            "b": np.ones(4, ml_dtypes.bfloat16),
            "c": np.ones(4, np.int64),
        },
        path,
    )


def _shards(path: Path) -> None:
    save_file({"a": np.ones(2, np.float32)}, path.parent / "model-1.safetensors")
    path.write_text(json.dumps({"metadata": {}, "weight_map": {"a": "model-1.safetensors"}}))


def _gguf(path: Path) -> None:
    writer = gguf.GGUFWriter(path, "llama")
    writer.add_block_count(1)
    writer.add_context_length(16)
    writer.add_embedding_length(64)
    writer.add_feed_forward_length(64)
    writer.add_head_count(2)
    writer.add_head_count_kv(2)
    writer.add_layer_norm_rms_eps(1e-5)
    writer.add_vocab_size(4)
    writer.add_tokenizer_model("gpt2")
    writer.add_tokenizer_pre("smollm")
    writer.add_token_list(["a", "b", "ab", "<|im_start|>"])
    writer.add_token_types([1, 1, 1, 3])
    writer.add_token_merges(["a b"])
    kind = gguf.GGMLQuantizationType.Q8_0
    table = np.linspace(-1, 1, 256, dtype=np.float32).reshape(4, 64)
    writer.add_tensor("token_embd.weight", gguf.quants.quantize(table, kind), raw_dtype=kind)
    writer.add_tensor("blk.0.attn_q.weight", np.ones((64, 64), np.float32))
    writer.write_header_to_file()
    writer.write_kv_data_to_file()
    writer.write_tensors_to_file()
    writer.close()


def _tokenizer(path: Path) -> None:
    marks = {"<|startoftext|>": 4, "<|endoftext|>": 5}
    path.write_text(json.dumps({"a": 0, "b": 1, "b</w>": 2, "ab</w>": 3} | marks))
    (path.parent / "merges.txt").write_text("#version: 0.2\na b</w>\n")


def _read_gguf(path: Path) -> None:
    file = read_gguf(path)
    for name in file.arrays:
        file.arrays[name]
    LlamaConfig.from_gguf(file.metadata, str(path))
    tokenizer_from_gguf(file.metadata, str(path))


def _read_arrays(path: Path) -> None:
    arrays = open_arrays(path)
    for name in arrays:
        arrays[name]


def _read_scene(path: Path) -> None:
    scene_for(path, None, {})


def _read_config(kind: type, path: Path) -> None:
    from jaxphys.core.files import read_json

    kind.from_json(read_json(path), str(path))


def _load(path: Path) -> None:
    load(path, count=20)


def _text(data: bytes, random: Random) -> bytes:
    text = mutations.mutated_text(data.decode(errors="replace"), random)
    return text.encode(errors="surrogatepass")


def _ply_header(data: bytes, random: Random) -> bytes:
    header, table = data.split(b"end_header\n", 1)
    return _text(header, random) + b"end_header\n" + table


def _value(data: bytes, random: Random) -> bytes:
    return mutations.json_bytes(json.loads(data), random)


BYTES = mutations.mutated_bytes
CASES = {
    "ply": Case("a.ply", _splats, (BYTES, _ply_header), _load),
    "ascii ply": Case("a.ply", _ascii_splats, (BYTES, _text), _load),
    "compressed ply": Case("a.ply", _harmonics, (BYTES, _ply_header), _load),
    "spz": Case("a.spz", _harmonics, (BYTES, _unzipped, _unzipped), _load),
    "splat": Case("a.splat", _splat, (BYTES,), _load),
    "obj": Case("a.obj", _obj, (_text, _text, BYTES), _load),
    "mtl": Case("m.mtl", lambda p: _obj(p.parent / "a.obj"), (_text, BYTES),
                lambda p: _load(p.parent / "a.obj")),
    "picture": Case("p.png", lambda p: _obj(p.parent / "a.obj"), (BYTES,),
                    lambda p: _load(p.parent / "a.obj")),
    "glb": Case("a.glb", _glb, (BYTES, mutations.with_gltf_json), _load),
    "stl": Case("a.stl", _mesh, (BYTES,), _load),
    "text stl": Case("a.stl", _text_mesh, (_text,), _load),
    "off": Case("a.off", _text_mesh, (_text, BYTES), _load),
    "scene": Case("a.json", _scene, (_value,), _read_scene),
    "plain scene": Case("a.json", _default_scene, (_value,), _read_scene),
    "physgaussian": Case("a.json", partial(_json, PHYSGAUSSIAN), (_value,), _read_scene),
    "safetensors": Case("a.safetensors", _arrays, (BYTES, mutations.with_json_header),
                        _read_arrays),
    "shards": Case("model.safetensors.index.json", _shards, (_value,), _read_arrays),
    "gguf": Case("a.gguf", _gguf, (BYTES,), _read_gguf),
    "torch": Case("a.pt", lambda p: p.write_bytes(STATE.read_bytes()), (BYTES,), read_torch_zip),
    "llama": Case("config.json", partial(_json, LLAMA), (_value,),
                  partial(_read_config, LlamaConfig)),
    "clip": Case("config.json",
                 partial(_json, {"model_type": "clip_text_model", "hidden_size": 512,
                                 "num_attention_heads": 8, "layer_norm_eps": 1e-5}),
                 (_value,), partial(_read_config, TextConfig)),
    "unet": Case("config.json", partial(_json, {"block_out_channels": [32, 64, 64, 64],
                                                "norm_eps": 1e-5, "attention_head_dim": [2] * 4}),
                 (_value,), partial(_read_config, UNetConfig)),
    "scheduler": Case("config.json",
                      partial(_json, {"_class_name": "DDIMScheduler", "beta_start": 0.00085,
                                      "steps_offset": 1, "clip_sample": False}),
                      (_value,), partial(_read_config, SchedulerConfig)),
    "tokenizer": Case("vocab.json", _tokenizer, (_value, BYTES),
                      lambda p: ClipTokenizer(p.parent)(["a b"])),
    "prompt": Case("prompt.json", partial(_json, {"original": "a can", "refined": "a can"}),
                   (_value,), lambda p: find_prompt(p.parent)),
}  # fmt: skip


def spoil(case: Case, folder: Path, random: Random) -> Path:
    """Writes the case's files to `folder`, spoils one, and returns it."""
    path = folder / case.file
    case.write(path)
    path.write_bytes(random.choice(case.mutate)(path.read_bytes(), random))
    return path
