"""Traffic between devices, counted in the text of a compiled program."""

from benchmarks.plot_scaling import device_rows, tables
from benchmarks.scaling import in_loops, traffic

PROGRAM = """HloModule jit_rollout

%region_0.1 (a: f32[]) -> f32[] {
  ROOT %all-reduce.9 = f32[100]{0} all-reduce(f32[100] %x), replica_groups={}
}

%body.2 (p: f32[2]) -> f32[2] {
  %permute.1 = f32[8,10]{1,0} collective-permute(f32[8,10]{1,0} %a), source_target_pairs={{0,1},{1,2},{2,3}}
  %permute.2 = f32[4,10]{1,0} collective-permute(f32[4,10]{1,0} %a), source_target_pairs={{1,0},{2,1},{3,2}}
  %sum = (f32[6]{0}, f32[2]{0}) all-reduce(f32[6]{0} %b, f32[2]{0} %c), replica_groups={}
  %gather = s32[4,7]{1,0} all-gather(s32[1,7]{1,0} %n), replica_groups={}
}

ENTRY %main () -> f32[] {
  %w = f32[2] while(%t), condition=%c, body=%body.2
  %all-reduce.3 = f32[1000]{0} all-reduce(f32[1000] %x)
}
"""  # noqa: E501


def test_a_step_counts_what_its_busiest_device_sends():
    step = in_loops(PROGRAM)
    assert "permute.1" in step and "f32[1000]" not in step and "f32[100]" not in step
    # Device 1 or 2: both bands; of the rest three quarters, twice where all have the sum.
    assert traffic(step, 4) == 4 * (80 + 40) + 2 * 0.75 * 4 * 8 + 0.75 * 4 * 28


def test_both_ways_are_in_the_tables():
    def line(devices, kilobytes):
        return {
            "devices": devices,
            "particles": 64_000 * devices,
            "seconds": 0.1,
            "steps": 10,
            "work": 1.0,
            "traffic_bytes": 1e3 * kilobytes,
        }

    lines = {
        ("weak-4", "jaxphys"): line(4, 410),
        ("weak-4", "jaxphys-window"): line(4, 1536),
        ("weak-2", "jaxphys"): line(2, 139),
        ("strong", "jaxphys"): {"seconds": 1.0},
        ("strong", "jaxphys-1-device"): {"seconds": 1.5},
    }
    assert device_rows(lines, "jaxphys") == [
        (2, 128_000, 10.0, 139.0),
        (4, 256_000, 10.0, 410.0),
    ]
    text = tables(lines)
    assert "| 4, the window on each | 256,000 | 10.0 | 1536 |" in text
    assert "1 to 2 devices, slabs: 1.50" in text
