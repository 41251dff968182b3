import json
import threading
from http.server import BaseHTTPRequestHandler, HTTPServer

import pytest

from jaxphys.core.errors import InputError
from jaxphys.guidance.refine import instruction, refine


def test_short_prompts_are_elaborated():
    result = refine("a strawberry", {})
    assert result.original == "a strawberry"
    assert result.refined.startswith("a strawberry, ") and "seeds" in result.refined
    assert result.how.startswith("offline") and "elaborated" in result.how
    # An object the rules do not know still gets a fuller description.
    assert refine("a zorgle", {}).refined.count(",") >= 3


def test_long_prompts_are_reduced_and_keep_their_object():
    prompt = (
        "I would really like to see a small vintage teapot that has a curved golden spout and a "
        "painted blue dragon which is chasing a tiny phoenix around it while steam rises slowly"
    )
    result = refine(prompt, {})
    assert "reduced" in result.how
    assert len(result.refined) < len(prompt) and result.refined.count(",") <= 5
    assert "teapot" in result.refined and "golden spout" in result.refined


@pytest.mark.parametrize(
    ("prompt", "gone"),
    [
        ("a red rose on a wooden table in a sunny kitchen", ["table", "kitchen"]),
        ("a burger, soft studio lighting, with a blurred background", ["background"]),
        ("a microphone against a dark backdrop", ["backdrop"]),
    ],
)
def test_backgrounds_are_removed(prompt, gone):
    refined = refine(prompt, {}).refined
    assert not any(word in refined for word in gone)
    assert refined.startswith(prompt.split()[0])


def test_what_an_object_holds_is_not_background():
    assert refine("a vase with flowers", {}).refined.startswith("a vase with flowers")
    assert "cone" in refine("vanilla ice in a cone", {}).refined


def test_refinement_is_deterministic():
    assert refine("a guitar", {}) == refine("a guitar", {})


@pytest.mark.parametrize("prompt", ["", "   ", "?!", "a\x00b", "x" * 3000])
def test_unusable_prompts(prompt):
    with pytest.raises(InputError, match=r"^prompt: "):
        refine(prompt, {})


@pytest.fixture
def endpoint():
    """A local server that records requests and answers with `reply`."""
    seen = {"reply": b"", "status": 200}

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self):
            seen["path"] = self.path
            seen["key"] = self.headers.get("Authorization")
            seen["body"] = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
            self.send_response(seen["status"])
            self.end_headers()
            self.wfile.write(seen["reply"])

        def log_message(self, *_):
            """Silent."""

    server = HTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True)
    thread.start()
    seen["environment"] = {
        "JAXPHYS_LLM_URL": f"http://127.0.0.1:{server.server_port}/v1",
        "JAXPHYS_LLM_MODEL": "small",
        "JAXPHYS_LLM_KEY": "secret-key",
    }
    yield seen
    server.shutdown()
    server.server_close()
    thread.join()


def test_endpoint_gets_context_and_task(endpoint):
    answer = {"choices": [{"message": {"content": '"a rose,\n red petals ,, thorns."'}}]}
    endpoint["reply"] = json.dumps(answer).encode()
    result = refine("a rose", endpoint["environment"])
    assert result.refined == "a rose, red petals, thorns"
    assert result.how == "endpoint (small)"
    assert endpoint["path"] == "/v1/chat/completions" and endpoint["key"] == "Bearer secret-key"
    assert endpoint["body"]["messages"][0]["content"] == instruction("a rose")
    assert "Context:" in instruction("a rose") and "Task:" in instruction("a rose")


@pytest.mark.parametrize(
    ("status", "reply"), [(401, b"{}"), (200, b"not json"), (200, b"{}"), (200, b'{"choices": []}')]
)
def test_endpoint_failures_are_one_line_without_the_key(endpoint, status, reply):
    endpoint["status"], endpoint["reply"] = status, reply
    with pytest.raises(InputError) as error:
        refine("a rose", endpoint["environment"])
    assert "JAXPHYS_LLM" in str(error.value) and "\n" not in str(error.value)
    assert "secret-key" not in str(error.value)


def test_half_configured_endpoint():
    with pytest.raises(InputError, match="JAXPHYS_LLM_MODEL"):
        refine("a rose", {"JAXPHYS_LLM_URL": "http://localhost"})
    with pytest.raises(InputError, match="http"):
        refine("a rose", {"JAXPHYS_LLM_URL": "file:///etc", "JAXPHYS_LLM_MODEL": "m"})
