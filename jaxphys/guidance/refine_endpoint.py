"""A chat model behind an OpenAI-compatible address: GPT-4 as in the paper, or a local server.

The key goes into the request's header and nowhere else: not into errors, records or logs.
"""

import json
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass, field

from jaxphys.core.errors import InputError

ADDRESS, KEY, MODEL = "JAXPHYS_LLM_URL", "JAXPHYS_LLM_KEY", "JAXPHYS_LLM_MODEL"
DEFAULT_MODEL = "gpt-4"
LONGEST_REPLY = 64 * 1024  # bytes
DEADLINE = 60.0  # seconds for a whole answer


TASK = (
    "Rewrite this prompt for a text-to-3D model that knows only simple descriptions. Answer with "
    "the rewritten prompt alone: one line, the object first, then its traits separated by commas "
    "(shape, parts, colours, material, surface). If the prompt is short or vague, add fitting "
    "visual details. If it is long or involved, keep its essence and drop the rest; resolve "
    "contradictions. Describe one object by itself: leave out background, place, lighting, camera, "
    "people and story."
)


class Unanswered(Exception):
    """Whoever was asked gave no answer; the message says why in a few words."""


@dataclass(frozen=True)
class Endpoint:
    """Where to ask, which model, and the key, which does not show when this is printed."""

    address: str
    model: str
    key: str = field(default="", repr=False)

    @property
    def who(self) -> str:
        return f"endpoint ({self.model})"

    def without_key(self, text: str) -> str:
        """A text from the other side, which may repeat what it was sent."""
        return text.replace(self.key, "[key]") if self.key else text

    def instruction(self, prompt: str) -> str:
        """The context part with the prompt, then the task part, as in the paper."""
        context = f"the prompt of a text-to-3D generation is: {json.dumps(prompt)}"
        return f"Context: {context}\n\nTask: {TASK}"

    def ask(self, prompt: str, attempt: int = 0) -> str:
        """The model's answer to the instruction: the likeliest at first, other draws for later
        attempts. Raises Unanswered after `DEADLINE` seconds at most.
        """
        text, deadline = self.instruction(prompt), DEADLINE
        outcome: dict[str, str] = {}
        thread = threading.Thread(
            target=self._fill, args=(outcome, text, attempt, deadline), daemon=True
        )
        thread.start()
        # A server that sends a byte now and then would keep every single read alive.
        thread.join(deadline)
        if thread.is_alive():
            raise Unanswered(f"no answer within {deadline:g} s")
        if "problem" in outcome:
            raise Unanswered(self.without_key(outcome["problem"]))
        return self.without_key(outcome["answer"])

    def _fill(self, outcome: dict[str, str], text: str, attempt: int, deadline: float) -> None:
        import openai

        try:
            outcome["answer"] = _content(self._reply(text, attempt, deadline))
        except openai.APIStatusError as error:
            outcome["problem"] = f"answered with status {error.status_code}"
        except openai.OpenAIError as error:
            outcome["problem"] = f"cannot be reached ({type(error).__name__})"
        except Unanswered as error:
            outcome["problem"] = str(error)
        except Exception as error:  # anything else that a strange server brings about
            outcome["problem"] = f"failed ({type(error).__name__})"

    def _reply(self, text: str, attempt: int, deadline: float) -> bytes:
        import openai

        end = time.monotonic() + deadline
        with openai.OpenAI(
            base_url=self.address,
            api_key=self.key or "none",
            timeout=deadline,
            max_retries=0,
        ) as client:
            request = client.chat.completions.with_streaming_response.create(
                model=self.model,
                messages=[{"role": "user", "content": text}],
                temperature=0.0 if attempt == 0 else 0.7,
                seed=attempt,
            )
            with request as response:
                reply = b""
                for part in response.iter_bytes(4096):
                    reply += part
                    if len(reply) > LONGEST_REPLY:
                        raise Unanswered(f"answered more than {LONGEST_REPLY} bytes")
                    if time.monotonic() > end:
                        raise Unanswered(f"no answer within {deadline:g} s")
        return reply


def _content(reply: bytes) -> str:
    try:
        content = json.loads(reply)["choices"][0]["message"]["content"]
    except (ValueError, LookupError, TypeError, RecursionError):
        content = None
    if not isinstance(content, str):
        raise Unanswered("answered with something that is no chat completion")
    return content


def find_endpoint(environment: Mapping[str, str]) -> Endpoint | None:
    """The endpoint that is set up, None if there is none.

    Raises:
        InputError: the address is none, or the client is not installed.
    """
    address = environment.get(ADDRESS, "").strip()
    if not address:
        return None
    if not address.startswith(("http://", "https://")):
        raise InputError(f"{ADDRESS}: must begin with http:// or https://")
    try:
        import openai  # noqa: F401
    except ImportError:
        raise InputError(
            f"{ADDRESS}: is set, but the client is missing; pip install 'jaxphys-splats[models]',"
            " or unset it"
        ) from None
    model = environment.get(MODEL, "").strip() or DEFAULT_MODEL
    return Endpoint(address, model, environment.get(KEY, "").strip())
