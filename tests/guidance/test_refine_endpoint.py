import dataclasses
import io
import json
import logging
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest

from jaxphys.guidance import refine_endpoint
from jaxphys.guidance.refine import ATTEMPTS, refine
from jaxphys.guidance.refine_endpoint import LONGEST_REPLY, Endpoint

KEY = "secret-key-0123456789"
GOOD = "a rose, layered red petals, green stem, small thorns"


def completion(content) -> bytes:
    return json.dumps({"choices": [{"message": {"content": content}}]}).encode()


@pytest.fixture
def server():
    """A loopback server; `behave(handler)` answers, `seen` holds what it was asked."""

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self):
            body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
            running.seen.append((self.path, self.headers.get("Authorization"), body))
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
    assert "does not name the object (rose)" in result.attempts[0]
    assert len({body["seed"] for _, _, body in server.seen}) == ATTEMPTS


def hang(handler):
    time.sleep(30)


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


def endless(handler):
    handler.send_response(200)
    handler.send_header("Content-Type", "text/event-stream")
    handler.end_headers()
    while True:
        handler.wfile.write(b'data: {"choices": [{"delta": {"content": "\xff\x00"}}]}\n\n' * 50)


def ten_megabytes(handler):
    handler.reply(completion("a rose, " * 1_300_000))


@pytest.mark.parametrize(
    ("behave", "said"),
    [
        (hang, "no answer within 1 s"),
        (drip, "no answer within 1 s"),
        (drip_headers, "endpoint"),
        (endless, f"more than {LONGEST_REPLY} bytes"),
        (ten_megabytes, f"more than {LONGEST_REPLY} bytes"),
        (lambda h: h.reply(b"{}", 500), "status 500"),
        (lambda h: h.reply(b'{"error": "bad key"}', 401), "status 401"),
        (lambda h: h.reply(b"not json"), "no chat completion"),
        (lambda h: h.reply(b"{}"), "no chat completion"),
        (lambda h: h.reply(b'{"choices": []}'), "no chat completion"),
        (lambda h: h.reply(b"[" * 20_000), "no chat completion"),
        (lambda h: h.reply(completion(["a rose"])), "no chat completion"),
        (lambda h: h.wfile.write(b"\xff\x00garbage\r\n\r\n"), "endpoint"),
        (lambda h: None, "endpoint"),
    ],
)
def test_failures_fall_through_to_the_rules(server, monkeypatch, behave, said):
    monkeypatch.setattr(refine_endpoint, "DEADLINE", 1.0)
    server.behave = behave
    begin = time.monotonic()
    result = refine("a rose", server.environment)
    assert time.monotonic() - begin < 20  # not a hang; the deadline itself is 1 s
    assert result.refined == refine("a rose", {}).refined and result.how.startswith("offline")
    assert len(result.attempts) == 1 and said in result.attempts[0]
    assert "\n" not in result.attempts[0] and len(server.seen) == 1


def test_nobody_at_the_address(server):
    server.environment["JAXPHYS_LLM_URL"] = "http://127.0.0.1:9/v1"
    result = refine("a rose", server.environment)
    assert result.how.startswith("offline") and "cannot be reached" in result.attempts[0]


def test_bad_answers_are_not_asked_for_for_ever(server):
    server.behave = lambda handler: handler.reply(completion("no"))
    result = refine("a rose", server.environment)
    assert len(server.seen) == ATTEMPTS == len(result.attempts)
    assert result.how.startswith("offline")


@pytest.mark.parametrize("status", [200, 400])
def test_the_key_is_nowhere(server, status, monkeypatch, capfd):
    """The other side repeats what it was sent; libraries log all they can."""
    monkeypatch.setenv("OPENAI_LOG", "debug")
    stream = io.StringIO()
    handler = logging.StreamHandler(stream)
    root = logging.getLogger()
    before = root.level
    loggers = [logging.getLogger(name) for name in ("openai", "httpx", "httpcore", "httpx2")]
    root.addHandler(handler)
    root.setLevel(logging.DEBUG)
    for logger in loggers:
        logger.setLevel(logging.DEBUG)
    echo = completion(f"a rose, {KEY} petals, green stem, thorns, {KEY}")
    server.behave = lambda handler: handler.reply(echo, status)
    try:
        result = refine("a rose", server.environment)
    finally:
        root.removeHandler(handler)
        root.setLevel(before)
        for logger in loggers:
            logger.setLevel(logging.NOTSET)
    assert server.seen[0][1] == f"Bearer {KEY}"
    shown = [json.dumps(dataclasses.asdict(result)), stream.getvalue(), *capfd.readouterr()]
    assert stream.getvalue() and not any(KEY in text for text in shown)
    assert ("[key]" in result.answer) == (status == 200)
    assert KEY not in repr(Endpoint("http://x", "m", KEY))
