"""Who may use the viewer: this user, by its own address, from its own page."""

from __future__ import annotations

import os
import stat

import pytest

from meshgauge.view import guard

HEAD = "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout inode\n"


def test_whose_a_connection_is() -> None:
    table = HEAD + "   0: 0100007F:A001 0100007F:1F90 01 00000000:00000000 00:00000000 00000000  1234        0 1\n"
    assert guard.owner(table, 0xA001, 0x1F90) == 1234
    assert guard.owner(table, 0xA002, 0x1F90) is None
    assert not guard.is_allowed(("10.0.0.1", 1), 8080)
    assert not guard.is_allowed(None, 8080)


@pytest.mark.parametrize(
    ("host", "origin", "is_ours"),
    [
        ("127.0.0.1:8080", None, True),
        ("localhost:8080", "http://localhost:8080", True),
        ("127.0.0.1:8080", "http://127.0.0.1:8080", True),
        ("evil.example:8080", None, False),
        ("evil.example", "http://evil.example", False),
        ("127.0.0.1:8080", "http://evil.example:8080", False),
        ("127.0.0.1:8080", "https://127.0.0.1:8080", False),
        ("127.0.0.1:8080", "null", False),
        ("127.0.0.1:9090", None, False),
        ("127.0.0.1.evil.example:8080", None, False),
        (None, None, False),
    ],
)
def test_requests_by_other_names_or_from_other_pages_are_refused(
    host: str | None, origin: str | None, is_ours: bool
) -> None:
    headers = {name: value for name, value in (("Host", host), ("Origin", origin)) if value is not None}
    assert guard.is_addressed(headers, 8080) == is_ours


def test_the_secret_is_random_and_in_a_file_that_only_the_user_reads() -> None:
    assert len({guard.secret() for _ in range(100)}) == 100
    assert min(len(guard.secret()) for _ in range(100)) == 48
    page = guard.redirect_page("http://127.0.0.1:1/a?b=1&c=<d>")
    assert "url=http://127.0.0.1:1/a?b=1&amp;c=&lt;d&gt;" in page.read_text()
    if os.name == "posix":
        assert stat.S_IMODE(page.stat().st_mode) == 0o600
        assert stat.S_IMODE(page.parent.stat().st_mode) == 0o700


def test_browsers_set_controls_only() -> None:
    pytest.importorskip("wslink", reason="the extra 'view' is not installed")

    class Protocol:
        def __init__(self) -> None:
            self.state: dict[str, object] = {}

        def update_state(self, changes: list[dict[str, object]]) -> None:
            self.state.update({str(change["key"]): change.get("value") for change in changes})

    protocol = Protocol()
    guard.only_controls(protocol, ("quality", "theme"))
    protocol.update_state([{"key": "quality", "value": 1}, {"key": "names", "value": "<b>"}, {"value": 2}])
    assert protocol.state == {"quality": 1}
    exported = type(protocol).update_state
    assert vars(exported)["_wslinkuris"][0]["uri"] == "trame.state.update", "wslink finds this one"
