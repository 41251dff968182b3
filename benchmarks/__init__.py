"""Benchmarks: problems, methods and peers, one JSON line a run.

python -m benchmarks run all --quick --out outputs/bench.jsonl
"""
