"""Refinement by an endpoint, against servers on this computer that behave well and badly."""

import dataclasses
import gzip
import io
import json
import logging
import os
import subprocess
import sys
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.guidance.prompts.endpoint import LONGEST_REPLY, Endpoint, find_endpoint
from jaxphys.guidance.prompts.refine import ATTEMPTS, refine

KEY = "secret-key-0123456789"
GOOD = "a rose, layered red petals, green stem, small thorns"


def completion(content) -> bytes:
    return json.dumps({"choices": [{"message": {"content": content}}]}).encode()


@pytest.fixture
def server(tmp_path, monkeypatch):
    """A loopback server; `behave(handler)` answers, `seen` holds what it was asked. There is no
    local model, whatever else this computer has."""
    monkeypatch.setattr("jaxphys.guidance.prompts.refine.find_local", lambda environment: None)

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self):
            body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
            running.seen.append((self.path, self.headers.get("Authorization"), body))
            running.headers = dict(self.headers)
            try:
                running.behave(self)
            except OSError:
                running.cut_off = True  # the other side has had enough

        def reply(self, content: bytes, status: int = 200):
            self.send_response(status)
            self.send_header("Content-Type", "application/json")
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, *_):
            """Silent."""

    running = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    running.daemon_threads, running.block_on_close = True, False
    running.seen, running.cut_off = [], False
    running.behave = lambda handler: handler.reply(completion(GOOD))
    running.environment = {
        "JAXPHYS_LLM_URL": f"http://127.0.0.1:{running.server_port}/v1",
        "JAXPHYS_LLM_MODEL": "small",
        "JAXPHYS_LLM_KEY": KEY,
        "JAXPHYS_WEIGHTS": str(tmp_path),  # for processes of their own
        "HF_HUB_CACHE": str(tmp_path),
    }
    thread = threading.Thread(target=running.serve_forever, args=(0.01,), daemon=True)
    thread.start()
    yield running
    running.shutdown()
    running.server_close()
    thread.join()


def test_endpoint_gets_context_and_task(server):
    result = refine("a rose", server.environment)
    assert result.refined == GOOD and result.how == "endpoint (small)" and not result.attempts
    assert result.answer == GOOD
    (path, key, body), *more = server.seen
    assert path == "/v1/chat/completions" and key == f"Bearer {KEY}" and not more
    assert body["messages"] == [{"role": "user", "content": result.instruction}]
    context, task = result.instruction.split("\n\n")
    assert context.startswith("Context: ") and '"a rose"' in context
    assert task.startswith("Task: ") and "separated by commas" in task


def test_model_is_gpt_4_unless_named(server):
    del server.environment["JAXPHYS_LLM_MODEL"], server.environment["JAXPHYS_LLM_KEY"]
    assert refine("a rose", server.environment).how == "endpoint (gpt-4)"
    assert server.seen[0][2]["model"] == "gpt-4"


def test_an_unusable_answer_is_asked_for_again(server):
    answers = iter(["a tulip, red petals, green stem, leaves", "Sorry, I cannot.", GOOD])
    server.behave = lambda handler: handler.reply(completion(next(answers)))
    result = refine("a rose", server.environment)
    assert result.refined == GOOD and len(server.seen) == ATTEMPTS
    assert "does not name the object (rose)" in result.attempts[0].problem
    assert result.attempts[1].answer == "Sorry, I cannot."
    assert len({body["seed"] for _, _, body in server.seen}) == ATTEMPTS


def hang(handler):
    time.sleep(60)


def drip(handler):
    handler.send_response(200)
    handler.end_headers()
    while True:
        handler.wfile.write(b" ")
        time.sleep(0.05)


def drip_headers(handler):
    handler.wfile.write(b"HTTP/1.1 200 OK\r\n")
    while True:
        handler.wfile.write(b"X-More: 1\r\n")
        time.sleep(0.05)


def endless(handler, status: int = 200):
    handler.send_response(status)
    handler.send_header("Content-Type", "text/event-stream")
    handler.end_headers()
    while True:
        handler.wfile.write(b'data: {"choices": [{"delta": {"content": "\xff\x00"}}]}\n\n' * 50)


def ten_megabytes(handler):
    handler.reply(completion("a rose, " * 1_300_000))


def squeezed(handler):
    """A gigabyte that travels as a megabyte, to somebody who asked for no such thing."""
    handler.send_response(200)
    handler.send_header("Content-Encoding", "gzip")
    handler.end_headers()
    handler.wfile.write(gzip.compress(bytes(2**20)) * 1000)


def elsewhere(handler):
    handler.send_response(307)
    handler.send_header("Location", "/v1/chat/completions")
    handler.end_headers()


@pytest.mark.parametrize(
    ("behave", "said"),
    [
        (endless, f"more than {LONGEST_REPLY} bytes"),
        (ten_megabytes, f"more than {LONGEST_REPLY} bytes"),
        (squeezed, f"more than {LONGEST_REPLY} bytes"),
        (lambda h: endless(h, 500), "status 500"),
        (elsewhere, "status 307"),
        (lambda h: h.reply(b"{}", 500), "status 500"),
        (lambda h: h.reply(b'{"error": "bad key"}', 401), "status 401"),
        (lambda h: h.reply(b"", 204), "status 204|no chat completion"),
        (lambda h: h.reply(b"not json"), "no chat completion"),
        (lambda h: h.reply(b"{}"), "no chat completion"),
        (lambda h: h.reply(b'{"choices": []}'), "no chat completion"),
        (lambda h: h.reply(b"[" * 20_000), "no chat completion"),
        (lambda h: h.reply(completion(["a rose"])), "no chat completion"),
        (lambda h: h.reply(completion(None)), "no chat completion"),
        (lambda h: h.wfile.write(b"\xff\x00garbage\r\n\r\n"), "cannot be reached"),
        (lambda h: None, "cannot be reached"),
    ],
)
def test_failures_fall_through_to_the_rules(server, behave, said):
    server.behave = behave
    result = refine("a rose", server.environment)
    assert result.refined == refine("a rose", {}, "rules").refined and result.how.startswith(
        "offline"
    )
    (attempt,) = result.attempts
    assert any(part in attempt.problem for part in said.split("|"))
    assert attempt.who == "endpoint (small)" and "\n" not in attempt.problem
    assert len(server.seen) == 1


@pytest.mark.parametrize("behave", [hang, drip, drip_headers])
@pytest.mark.parametrize("patience", [0.2, 600.0])
def test_a_wait_in_vain_is_told_alike_by_either_clock(server, monkeypatch, behave, patience):
    """The client's clock for a single wait and ours for the whole answer: each is made the first in
    turn. Against drips the client's never rings.
    """
    client = Endpoint._client
    monkeypatch.setattr(Endpoint, "_client", lambda self, seconds: client(self, patience))
    quick = patience < 1 and behave is hang
    seconds = 600 if quick else 1
    server.environment["JAXPHYS_LLM_TIMEOUT"] = str(seconds)
    server.behave = behave
    find_endpoint(server.environment)  # imports the client, which takes its time
    (attempt,) = refine("a rose", server.environment).attempts
    assert attempt.problem == f"no answer within {seconds} s"


def test_whoever_is_left_waiting_is_hung_up_on(server):
    server.environment["JAXPHYS_LLM_TIMEOUT"] = "0.5"
    server.behave = drip_headers
    before = threading.active_count()
    refine("a rose", server.environment)
    for _ in range(1200):
        if server.cut_off and threading.active_count() <= before:
            return
        time.sleep(0.05)
    pytest.fail("the connection or the thread outlives the question")


def test_the_time_is_for_all_answers_together(server, monkeypatch):
    """By a clock that the server moves on by 200 s an answer."""
    passed = [0.0]
    monkeypatch.setattr("jaxphys.guidance.prompts.endpoint.monotonic", lambda: passed[0])

    def slow(handler):
        passed[0] += 200.0
        handler.reply(completion("no"))

    server.environment["JAXPHYS_LLM_TIMEOUT"] = "500"
    server.behave = slow
    result = refine("a rose", server.environment)
    # With 500 s for each, all three answers would have come.
    assert result.attempts[-1].problem == "no answer within 500 s" and len(server.seen) == ATTEMPTS
    assert "has 1 words" in result.attempts[0].problem


def test_nobody_at_the_address(server):
    server.environment["JAXPHYS_LLM_URL"] = "http://127.0.0.1:9/v1"
    result = refine("a rose", server.environment)
    assert result.how.startswith("offline")
    assert "cannot be reached" in result.attempts[0].problem


def test_bad_answers_are_not_asked_for_for_ever(server):
    server.behave = lambda handler: handler.reply(completion("no"))
    result = refine("a rose", server.environment)
    assert len(server.seen) == ATTEMPTS == len(result.attempts)
    assert result.how.startswith("offline")


def test_noise_instead_of_http_is_a_problem_and_no_more(server):
    random = np.random.default_rng(0)
    start = b"HTTP/1.1 200 OK\r\nContent-Length: 40\r\nX: y\r\n\r\n" + completion(GOOD)
    for _ in range(40):
        noise = bytearray(start)
        for place in random.integers(0, len(noise), 3):
            noise[place] = random.integers(256)
        server.behave = lambda handler, noise=bytes(noise): handler.wfile.write(noise)
        assert refine("a rose", server.environment).refined


def test_nothing_of_the_environment_is_sent_along(server, monkeypatch):
    nobody = "http://127.0.0.1:9"
    for name in ("HTTP_PROXY", "http_proxy", "ALL_PROXY", "all_proxy"):
        monkeypatch.setenv(name, nobody)
    monkeypatch.delenv("NO_PROXY", raising=False)
    monkeypatch.delenv("no_proxy", raising=False)
    for name in ("API_KEY", "ADMIN_KEY", "ORG_ID", "PROJECT_ID"):
        monkeypatch.setenv(f"OPENAI_{name}", "private")
    monkeypatch.setenv("OPENAI_CUSTOM_HEADERS", "Authorization: private\nX-Own: private")
    assert refine("a rose", server.environment).refined == GOOD
    assert "private" not in json.dumps(server.headers)
    assert server.headers["Authorization"] == f"Bearer {KEY}"
    assert not any(name.lower().startswith(("x-stainless-os", "openai")) for name in server.headers)
    del server.environment["JAXPHYS_LLM_KEY"]
    refine("a rose", server.environment)
    assert "Authorization" not in server.headers


def tell_tale(status: int):
    """Repeats the key wherever an answer has room for it."""

    def behave(handler):
        handler.send_response(status, f"it is {KEY}")
        handler.send_header("X-Request-Id", KEY)
        handler.send_header("Set-Cookie", f"key={KEY}")
        handler.end_headers()
        said = f"a rose, {KEY} petals, green stem, thorns, {KEY}"
        handler.wfile.write(completion(said) if status == 200 else said.encode())

    return behave


@pytest.mark.parametrize("status", [200, 401, 500])
def test_the_key_is_nowhere(server, status, capfd):
    """The other side repeats what it was sent; the libraries log all they can."""
    stream, root = io.StringIO(), logging.getLogger()
    find_endpoint(server.environment)  # imports the client, and with it its loggers
    handler, before = logging.StreamHandler(stream), root.level
    families = ("openai", "httpx", "httpcore")
    known = [name for name in root.manager.loggerDict if name.startswith(families)]
    loggers = {logging.getLogger(name): logging.getLogger(name).level for name in known}
    root.addHandler(handler)
    for logger in (root, *loggers):
        logger.setLevel(logging.DEBUG)
    server.behave = tell_tale(status)
    try:
        result = refine("a rose", server.environment)
    finally:
        root.removeHandler(handler)
        for logger, level in (loggers | {root: before}).items():
            logger.setLevel(level)
    assert server.seen[0][1] == f"Bearer {KEY}"
    shown = [json.dumps(dataclasses.asdict(result)), stream.getvalue(), *capfd.readouterr()]
    assert "receive_response_headers" in stream.getvalue() and "[key]" in stream.getvalue()
    assert not any(KEY in text for text in shown)
    assert ("[key] petals" in result.answer) == (status == 200)
    assert not any(logger.filters for logger in loggers if logger.name != "openai._base_client")


def test_the_key_is_nowhere_in_a_process_that_logs_everything(server):
    code = (
        "import logging; logging.basicConfig(level=logging.DEBUG);"
        "from jaxphys.guidance.prompts.refine import refine; print(refine('a rose'))"
    )
    server.behave = tell_tale(500)
    environment = os.environ | server.environment | {"OPENAI_LOG": "debug"}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0 and "status 500" in done.stdout
    assert "openai._base_client" in done.stderr and "[key]" in done.stderr
    assert KEY not in done.stdout + done.stderr


def test_the_key_does_not_show():
    assert KEY not in repr(Endpoint("http://x", "m", KEY))
    assert Endpoint("http://x", "m", KEY).without_key(f"a {KEY}s") == "a [key]s"
    # Keys that are no secret do not spoil the words that they are a part of.
    assert Endpoint("http://x", "m", "x").without_key("x box, x.") == "[key] box, [key]."
    assert Endpoint("http://x", "m").without_key("a rose") == "a rose"


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("URL", "file:///etc/passwd"),
        ("URL", "localhost:8000"),
        ("URL", "http://"),
        ("URL", "http://localhost:port/v1"),
        ("URL", "http://[::1/v1"),
        ("URL", "http://local host/v1"),
        ("URL", "http://a..b/v1"),
        ("URL", "http://localhost:99999/v1"),
        ("URL", "http://local\thost/v1"),
        ("URL", "http://" + "a" * 70 + ".org/v1"),
        ("URL", f"http://me:{KEY}@localhost/v1"),
        ("URL", f"http://localhost/v1?key={KEY}"),
        ("KEY", f"{KEY}\nX-Other: 1"),
        ("KEY", f"{KEY} two"),
        ("KEY", f"{KEY}é"),
        ("MODEL", "a\x00b"),
        ("TIMEOUT", "soon"),
        ("TIMEOUT", "0"),
        ("TIMEOUT", "nan"),
        ("TIMEOUT", "inf"),
    ],
)
def test_wrong_settings_are_named_but_not_repeated(server, name, value):
    server.environment[f"JAXPHYS_LLM_{name}"] = value
    with pytest.raises(InputError, match=rf"^JAXPHYS_LLM_{name}: ") as error:
        refine("a rose", server.environment)
    assert KEY not in str(error.value) and "\n" not in str(error.value)
    assert not server.seen
