"""Servers on this computer that stand for those of the network."""

import hashlib
import json
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

Answer = tuple[int, dict[str, str], bytes]
COMMIT = "0123456789abcdef0123456789abcdef01234567"


@contextmanager
def serving(answer: Callable[[str], Answer]) -> Iterator[tuple[str, list[str]]]:
    """The address of a server that gives `answer(path)`, (status, headers, body), and the list of
    what it is asked. A Content-Length among the headers is sent as it is, true or not."""
    asked = []

    class Handler(BaseHTTPRequestHandler):
        def do_HEAD(self):
            status, headers, body = answer(self.path)
            asked.append(f"{self.command} {self.path}")
            self.send_response(status)
            for name, value in {"Content-Length": str(len(body)), **headers}.items():
                self.send_header(name, value)
            self.end_headers()
            return body

        def do_GET(self):
            self.wfile.write(self.do_HEAD())

        def log_message(self, *_):
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}", asked
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def hub(repositories: dict[str, dict[str, bytes]]) -> Callable[[str], Answer]:
    """Answers as the Hugging Face hub does, for these files by path of these repositories."""

    def answer(path: str) -> Answer:
        path = path.partition("?")[0]
        for name, files in repositories.items():
            if path.startswith(f"/api/models/{name}/revision/"):
                siblings = [{"rfilename": file} for file in files]
                return _json({"id": name, "sha": COMMIT, "siblings": siblings})
            if path.startswith(f"/api/models/{name}/tree/"):
                return _json(
                    [
                        {"type": "file", "path": file, "size": len(body), "oid": _blob(body)}
                        for file, body in files.items()
                    ]
                )
            start = f"/{name}/resolve/{COMMIT}/"
            if path.startswith(start) and path.removeprefix(start) in files:
                body = files[path.removeprefix(start)]
                return 200, {"ETag": f'"{_blob(body)}"', "X-Repo-Commit": COMMIT}, body
        return 404, {"X-Error-Code": "RepoNotFound"}, b"{}"

    return answer


def _json(value) -> Answer:
    return 200, {"Content-Type": "application/json"}, json.dumps(value).encode()


def _blob(body: bytes) -> str:
    return hashlib.sha1(b"blob %d\0" % len(body) + body).hexdigest()
