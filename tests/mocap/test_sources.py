"""Downloads against a real HTTP server on this machine: whole, broken, resumed, tampered with."""

import hashlib
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest

from motionenv.errors import MotionError
from motionenv.mocap.sources import Source, SourceFile, download, find_source, list_sources

CONTENT = {"02/02.asf": b":version 1.10\n" * 400, "02/02_01.amc": b":DEGREES\n" * 90_000, "05/05.asf": b":root\n" * 9}
ANSWERS = {"404": 404, "500": 500}


class Server(ThreadingHTTPServer):
    """Serves CONTENT; `troubles[path]` lists what to do instead, one entry per request, before it serves."""

    daemon_threads = True

    def __init__(self):
        super().__init__(("127.0.0.1", 0), Handler)
        self.troubles: dict[str, list[str]] = {}
        self.requests: list[str] = []
        self.headers: list[dict] = []

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_port}"


class Handler(BaseHTTPRequestHandler):
    def do_GET(self):
        path = self.path.removeprefix("/")
        self.server.requests.append(path)
        self.server.headers.append(dict(self.headers))
        troubles = self.server.troubles.get(path, [])
        trouble = troubles.pop(0) if troubles else None
        if trouble in ANSWERS:
            self.send_error(ANSWERS[trouble])
            return
        body = CONTENT[path]
        self.send_response(200)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        if trouble == "cut":
            self.wfile.write(body[: len(body) // 2])
            self.wfile.flush()
            self.connection.close()
        else:
            self.wfile.write(body if trouble is None else b"?" * len(body))

    def log_message(self, *args):
        pass


@pytest.fixture
def server():
    with Server() as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield server
        server.shutdown()
        thread.join()


@pytest.fixture
def source(server) -> Source:
    files = (
        SourceFile(path, f"{server.url}/{path}", hashlib.sha256(body).hexdigest(), len(body))
        for path, body in CONTENT.items()
    )
    return Source("walks", "Two walks", "http://example.org", "none", "thanks", tuple(files))


@pytest.fixture
def impatient(monkeypatch):
    """No waiting between retries."""
    monkeypatch.setattr("time.sleep", lambda seconds: None)


def everything_below(folder) -> dict[str, bytes]:
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_all_files_arrive_whole_and_in_order(server, source, tmp_path):
    seen = []
    paths = download(source, tmp_path / "new" / "folder", on_file=seen.append)
    assert everything_below(tmp_path / "new" / "folder") == CONTENT
    assert [p.relative_to(tmp_path / "new" / "folder").as_posix() for p in paths] == list(CONTENT)
    assert seen == list(source.files)


def test_nothing_is_printed(source, tmp_path, capfd):
    download(source, tmp_path)
    assert capfd.readouterr() == ("", "")


def test_the_blob_api_is_asked_for_the_file_itself(server, source, tmp_path):
    download(source, tmp_path)
    assert all(headers["Accept"].startswith("application/vnd.github.raw") for headers in server.headers)


def test_a_second_run_fetches_nothing(server, source, tmp_path):
    download(source, tmp_path)
    server.requests.clear()
    assert len(download(source, tmp_path)) == len(CONTENT)
    assert server.requests == []


def test_a_file_with_other_content_is_fetched_again(server, source, tmp_path):
    download(source, tmp_path)
    (tmp_path / "05" / "05.asf").write_bytes(b"half")
    server.requests.clear()
    download(source, tmp_path)
    assert server.requests == ["05/05.asf"]
    assert everything_below(tmp_path) == CONTENT


@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize("trouble", ["cut", "500", "404", "tampered"])
def test_trouble_that_passes_is_retried(server, source, tmp_path, trouble):
    server.troubles["02/02_01.amc"] = [trouble] * 2
    download(source, tmp_path)
    assert server.requests.count("02/02_01.amc") == 3
    assert everything_below(tmp_path) == CONTENT


@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize(
    ("trouble", "says"),
    [("cut", "IncompleteRead|Connection broken"), ("500", "500"), ("404", "404"), ("tampered", "other bytes")],
)
def test_trouble_that_stays_is_told_and_a_new_run_goes_on_from_there(server, source, tmp_path, trouble, says):
    server.troubles["02/02_01.amc"] = [trouble] * 3
    with pytest.raises(MotionError, match=says) as caught:
        download(source, tmp_path)
    assert f"{server.url}/02/02_01.amc" in str(caught.value)
    assert "repeat the download" in str(caught.value)
    assert everything_below(tmp_path) == {"02/02.asf": CONTENT["02/02.asf"]}
    server.requests.clear()
    download(source, tmp_path)
    assert server.requests == ["02/02_01.amc", "05/05.asf"]
    assert everything_below(tmp_path) == CONTENT


@pytest.mark.usefixtures("impatient")
def test_a_broken_replacement_leaves_the_old_file(server, source, tmp_path):
    (tmp_path / "02").mkdir()
    (tmp_path / "02" / "02.asf").write_bytes(b"old")
    server.troubles["02/02.asf"] = ["cut"] * 3
    with pytest.raises(MotionError):
        download(source, tmp_path)
    assert everything_below(tmp_path) == {"02/02.asf": b"old"}


@pytest.mark.usefixtures("impatient")
def test_no_server_at_all(source, server, tmp_path):
    server.server_close()
    server.shutdown()
    with pytest.raises(MotionError, match="can't fetch"):
        download(source, tmp_path)
    assert everything_below(tmp_path) == {}


def test_a_mirror_serves_the_same_paths(server, source, tmp_path):
    moved = Source("walks", "", "", "", "", tuple(SourceFile(f.path, "", f.sha256, f.bytes) for f in source.files))
    download(moved, tmp_path, base_url=server.url)
    assert everything_below(tmp_path) == CONTENT


def test_a_folder_that_is_a_file(source, tmp_path):
    (tmp_path / "taken").write_text("mine")
    with pytest.raises(MotionError, match="can't write"):
        download(source, tmp_path / "taken")
    assert (tmp_path / "taken").read_text() == "mine"


def test_an_unknown_name_lists_the_known(tmp_path):
    with pytest.raises(MotionError, match=r"'walk'.*cmu-walks"):
        download("walk", tmp_path)


def test_cmu_walks_tells_its_size_and_licence_first():
    text = str(find_source("cmu-walks"))
    assert "76 files, 21.1 MB" in text
    assert "may not be resold" in text
    assert "NSF EIA-0196217" in text


def test_every_source_names_immutable_content():
    """A commit or a git blob by its 40-digit hash, never a branch."""
    for source in list_sources():
        for file in source.files:
            assert len(file.sha256) == 64
            assert any(len(part) == 40 for part in file.url.split("/")), file.url
            assert not {"main", "master", "HEAD"} & set(file.url.split("/"))


def test_cmu_walks_is_the_capture_that_we_develop_with(mocap):
    """Names, sizes, SHA-256 and, where the URL has one, git's own blob hash, of the 59 trials and 17 skeletons."""
    folder = mocap / "cmu_asfamc"
    assert {p.relative_to(folder).as_posix() for p in folder.glob("*/*.a[sm][fc]")} == {
        file.path for file in find_source("cmu-walks").files
    }
    for file in find_source("cmu-walks").files:
        body = (folder / file.path).read_bytes()
        assert (len(body), hashlib.sha256(body).hexdigest()) == (file.bytes, file.sha256)
        if "/git/blobs/" in file.url:
            assert file.url.endswith(hashlib.sha1(b"blob %d\0" % len(body) + body).hexdigest())
        else:
            assert file.url.endswith(f"/{(folder / 'COMMIT').read_text().strip()}/data/{file.path}")
