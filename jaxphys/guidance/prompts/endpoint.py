"""A chat model behind an OpenAI-compatible address: GPT-4 as in the paper, or a local server.

The key goes into the request's header and nowhere else: the client is given none, so that none of
its errors or records can hold it; what the other side repeats of it is blotted out, in logs too.
"""

import json
import logging
import re
import sys
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from time import monotonic
from typing import Any
from urllib.parse import urlsplit

from jaxphys.core.errors import InputError

ADDRESS, KEY, MODEL = "JAXPHYS_LLM_URL", "JAXPHYS_LLM_KEY", "JAXPHYS_LLM_MODEL"
SECONDS = "JAXPHYS_LLM_TIMEOUT"
DEFAULT_MODEL = "gpt-4"
DEFAULT_SECONDS = 60.0  # for all answers to a prompt together
LONGEST_REPLY = 64 * 1024  # bytes
BLOT = "[key]"
NO_ADDRESS = "is no address; for example http://localhost:8000/v1"
# What a request says of itself; the client would add the system it runs on, and whatever the
# OPENAI_ variables of the environment hold. The last one is the client's note to itself.
HEADERS = {
    "accept", "accept-encoding", "connection", "content-length", "content-type", "host",
    "user-agent", "x-stainless-raw-response",
}  # fmt: skip
LOGGING = ("openai", "httpx", "httpx2", "httpcore", "httpcore2")

TASK = (
    "Rewrite this prompt for a text-to-3D model that knows only simple descriptions. Answer with "
    "the rewritten prompt alone: one line, the object first and under the name that it has in the "
    "prompt, then its traits separated by commas (shape, parts, colours, material, surface). If "
    "the prompt is short or vague, add fitting visual details. If it is long or involved, keep its "
    "essence and drop the rest; resolve contradictions. Describe one object by itself: leave out "
    "background, place, lighting, camera, people and story."
)


class Unanswered(Exception):
    """Whoever was asked gave no answer; the message says why in a few words."""


@dataclass(frozen=True)
class Endpoint:
    """Where to ask, which model, and the key, which does not show when this is printed. The time
    of `seconds` runs from the first question.
    """

    address: str
    model: str
    key: str = field(default="", repr=False)
    seconds: float = DEFAULT_SECONDS

    @property
    def who(self) -> str:
        return f"endpoint ({self.model})"

    @cached_property
    def _end(self) -> float:
        return monotonic() + self.seconds

    @property
    def _late(self) -> str:
        """What is said when the time is up. The client has a clock of its own for every single
        wait, lest a thread be left behind: whichever is first, the cause is the same.
        """
        return f"no answer within {self.seconds:g} s"

    def instruction(self, prompt: str) -> str:
        """The context part with the prompt, then the task part, as in the paper."""
        context = f"the prompt of a text-to-3D generation is: {json.dumps(prompt)}"
        return f"Context: {context}\n\nTask: {TASK}"

    def without_key(self, text: str) -> str:
        """A text from the other side, which may repeat what it was sent."""
        if not self.key:
            return text
        key = re.escape(self.key)
        # Keys that are no secret, "x" or "none", may be parts of words.
        return re.sub(key if len(self.key) >= 8 else rf"(?<!\w){key}(?!\w)", BLOT, text)

    def ask(self, prompt: str, attempt: int = 0) -> str:
        """The model's answer to the instruction: the likeliest at first, other draws for later
        attempts. Raises Unanswered, when the time is up at the latest.
        """
        body = {
            "model": self.model,
            "messages": [{"role": "user", "content": self.instruction(prompt)}],
            "temperature": 0.0 if attempt == 0 else 0.7,
            "seed": attempt,
        }
        outcome: dict[str, Any] = {}
        left = self._end - monotonic()
        if left <= 0:
            raise Unanswered(self._late)
        client = self._client(left)
        thread = threading.Thread(target=self._fill, args=(outcome, client, body), daemon=True)
        try:
            with blotted_logs(self.without_key):
                thread.start()
                # A server that sends a byte now and then would keep every single read alive.
                thread.join(left)
        finally:
            client.close()  # ends what the thread may still be reading
        if thread.is_alive():
            raise Unanswered(self._late)
        if "error" in outcome:
            raise outcome["error"]
        if "problem" in outcome:
            raise Unanswered(outcome["problem"])
        return self.without_key(outcome["answer"])

    def _client(self, seconds: float) -> Any:
        import openai

        def dress(request: Any) -> None:
            for name in [name for name in request.headers if name.lower() not in HEADERS]:
                del request.headers[name]
            request.headers["Accept-Encoding"] = "identity"
            if self.key:
                request.headers["Authorization"] = f"Bearer {self.key}"

        def glance(response: Any) -> None:
            if response.status_code >= 300:
                response.close()  # unread, or the client would read it to the end, wherever that is

        return openai.OpenAI(
            base_url=self.address,
            api_key="none",
            timeout=seconds,
            max_retries=0,
            http_client=openai.DefaultHttpxClient(
                trust_env=False,  # no proxy, no netrc
                follow_redirects=False,
                event_hooks={"request": [dress], "response": [glance]},
            ),
        )

    def _fill(self, outcome: dict[str, Any], client: Any, body: dict[str, Any]) -> None:
        import openai

        try:
            outcome["answer"] = _content(self._reply(client, body))
        except openai.APIStatusError as error:
            outcome["problem"] = f"answered with status {error.status_code}"
        except Unanswered as error:
            outcome["problem"] = str(error)
        except _timeouts():
            outcome["problem"] = self._late
        except _failures() as error:
            # Its text may hold anything that was sent; its kind says enough.
            outcome["problem"] = f"cannot be reached ({type(error).__name__})"
        except Exception as error:
            outcome["error"] = error

    def _reply(self, client: Any, body: dict[str, Any]) -> bytes:
        with client.chat.completions.with_streaming_response.create(**body) as response:
            reply = b""
            for part in response.http_response.iter_raw():
                reply += part
                if len(reply) > LONGEST_REPLY:
                    raise Unanswered(f"answered more than {LONGEST_REPLY} bytes")
                if monotonic() > self._end:
                    raise Unanswered(self._late)
        return reply


def _timeouts() -> tuple[type[Exception], ...]:
    import openai

    return (openai.APITimeoutError, *_transport_errors("TimeoutException"), TimeoutError)


def _failures() -> tuple[type[Exception], ...]:
    import openai

    return (openai.OpenAIError, *_transport_errors("HTTPError"), OSError)


def _transport_errors(name: str) -> tuple[type[Exception], ...]:
    """An exception of the library beneath the client: httpx, or httpx2 since openai 3."""
    libraries = [sys.modules[library] for library in ("httpx", "httpx2") if library in sys.modules]
    return tuple(getattr(library, name) for library in libraries)


def _content(reply: bytes) -> str:
    try:
        content = json.loads(reply)["choices"][0]["message"]["content"]
    except (ValueError, LookupError, TypeError, RecursionError):
        content = None
    if not isinstance(content, str):
        raise Unanswered("answered with something that is no chat completion")
    return content


@contextmanager
def blotted_logs(blot: Any) -> Iterator[None]:
    """Passes whatever the client's libraries log meanwhile through `blot` (str -> str)."""

    def clean(record: logging.LogRecord) -> bool:
        record.msg, record.args = blot(record.getMessage()), ()
        record.exc_info = record.exc_text = record.stack_info = None
        return True

    known = [name for name in logging.root.manager.loggerDict if name.split(".")[0] in LOGGING]
    loggers = [logging.getLogger(name) for name in known]
    for logger in loggers:
        logger.addFilter(clean)
    try:
        yield
    finally:
        for logger in loggers:
            logger.removeFilter(clean)


def find_endpoint(environment: Mapping[str, str]) -> Endpoint | None:
    """The endpoint that is set up, None if there is none.

    Raises:
        InputError: a setting is wrong, or the client is not installed.
    """
    address, key, model, seconds = (
        environment.get(name, "").strip() for name in (ADDRESS, KEY, MODEL, SECONDS)
    )
    if not address:
        return None
    _check_address(address)
    if not re.fullmatch(r"[!-~]*", key):
        raise InputError(f"{KEY}: holds characters that no key has; copy it again")
    if not model.isprintable():
        raise InputError(f"{MODEL}: holds control characters; name the model")
    try:
        time_out = float(seconds or DEFAULT_SECONDS)
    except ValueError:
        time_out = 0.0
    if not 0.0 < time_out <= 3600.0:
        raise InputError(f"{SECONDS}: expected seconds, more than 0 and at most 3600")
    try:
        import openai  # noqa: F401
    except ImportError:
        raise InputError(
            f"{ADDRESS}: is set, but the client is missing; pip install 'jaxphys-splats[models]',"
            " or unset it"
        ) from None
    return Endpoint(address, model or DEFAULT_MODEL, key, time_out)


def _check_address(address: str) -> None:
    """Messages never repeat the address: who puts a key into it should not see it in a log."""
    if not address.startswith(("http://", "https://")):
        raise InputError(f"{ADDRESS}: must begin with http:// or https://")
    try:
        parts = urlsplit(address)
        good = bool(parts.hostname and parts.hostname.encode("idna"))
        good &= parts.port is None or parts.port > 0
    except ValueError:  # of the port, of brackets, of labels between dots
        good = False
    if not good or not re.fullmatch(r"[!-~]+", address):
        raise InputError(f"{ADDRESS}: {NO_ADDRESS}")
    if parts.username is not None or parts.query or parts.fragment:
        raise InputError(f"{ADDRESS}: must be an address alone; a key belongs into {KEY}")
