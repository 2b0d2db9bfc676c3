"""What `mapweave keys` makes, and what is made of it."""

import json
import shutil
import stat
from datetime import UTC, datetime
from pathlib import Path

import pytest
from cryptography import x509

from mapweave.cli import main
from mapweave.errors import FileError, InvalidIdError
from mapweave_agent import Agent
from mapweave_deploy.keys.team_keys import make_keys
from mapweave_protocol.errors import WrongKeysError
from mapweave_protocol.link.security.access import access_rules
from mapweave_protocol.link.security.folder import KeyFolder
from mapweave_protocol.link.security.membership import operator_of
from mapweave_protocol.link.security.roster import Role, Roster
from mapweave_protocol.link.security.settings import OURS, LinkSettings
from mapweave_protocol.link.session import session_config

MEMBERS = {
    "router", "coordinator", "robots/r1", "robots/r2", "operators/ann", "viewers/bob",
}  # fmt: skip


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / "keys"
    words = ["keys", "rescue", "--robots", "r1", "r2", "--operators", "ann", "--viewers", "bob"]
    assert main([*words, "--hosts", "10.0.0.7", "base.local", "--output", str(folder)]) == 0
    return folder


def test_each_member_gets_a_folder_and_keys_are_for_their_owner_only(folder: Path) -> None:
    assert {str(path.parent.relative_to(folder)) for path in folder.rglob("cert.pem")} == MEMBERS
    secret = [*folder.rglob("key.pem"), folder / "ca.key"]
    assert len(secret) == len(MEMBERS) + 1
    assert {stat.S_IMODE(path.stat().st_mode) for path in secret} == {0o600}


def test_only_the_router_is_a_server_and_only_it_has_the_roster(folder: Path) -> None:
    for place in MEMBERS:
        certificate = x509.load_pem_x509_certificate((folder / place / "cert.pem").read_bytes())
        usage = certificate.extensions.get_extension_for_class(x509.ExtendedKeyUsage).value
        assert (x509.oid.ExtendedKeyUsageOID.SERVER_AUTH in usage) == (place == "router")
        identity = json.loads((folder / place / "member.json").read_text())
        assert ("robots" in identity) == (place == "router")
    names = x509.load_pem_x509_certificate((folder / "router" / "cert.pem").read_bytes())
    reached = names.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert {"localhost", "base.local"} <= set(reached.get_values_for_type(x509.DNSName))
    assert "10.0.0.7" in map(str, reached.get_values_for_type(x509.IPAddress))


def test_a_coordinator_with_a_page_for_others_is_a_server_of_that_and_knows_the_team(
    folder: Path,
) -> None:
    words = ["keys", "rescue", "--output", str(folder)]
    assert main([*words, "--page", "base.local"]) == 0
    assert main([*words, "--robots", "r3"]) == 0
    keys = KeyFolder.read(folder / "coordinator")
    assert (keys.page, keys.roster.robots) == (("base.local",), ("r1", "r2", "r3"))
    certificate = x509.load_pem_x509_certificate((keys.path / "cert.pem").read_bytes())
    usage = certificate.extensions.get_extension_for_class(x509.ExtendedKeyUsage).value
    names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert x509.oid.ExtendedKeyUsageOID.SERVER_AUTH in usage
    assert "base.local" in names.get_values_for_type(x509.DNSName)


def test_nothing_secret_is_printed(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["keys", "rescue", "--robots", "r3", "--output", str(folder)]) == 0
    said = capsys.readouterr()
    assert "PRIVATE" not in said.out + said.err
    assert len(said.out.splitlines()) == 1


def test_a_team_grows_and_who_has_keys_keeps_them(folder: Path) -> None:
    before = {path: path.read_bytes() for path in folder.rglob("*.pem")}
    assert main(["keys", "rescue", "--robots", "r3", "--output", str(folder)]) == 0
    assert {path: path.read_bytes() for path in before} == before
    assert KeyFolder.read(folder / "router").roster.robots == ("r1", "r2", "r3")
    assert KeyFolder.read(folder / "robots" / "r3").member.role is Role.ROBOT


def test_a_folder_of_another_team_is_left_as_it_is(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["keys", "office", "--robots", "r1", "--output", str(folder)]) == 1
    assert "the keys of another team" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["R1", "r1/..", "", "r.1", "x" * 33])
def test_a_name_that_is_no_id_gets_no_keys(tmp_path: Path, name: str) -> None:
    with pytest.raises(InvalidIdError):
        list(make_keys(Roster("rescue", (name,)), tmp_path, datetime.now(UTC), 1, []))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "words",
    [
        ("--hosts", "böse.local"),
        ("--hosts", "two words"),
        ("--hosts", "base.local:7447"),
        ("--page", "tls/base.local"),
        ("--page", ""),
        ("--hosts", "a" * 64),
        ("--hosts", ".".join(["a" * 60] * 5)),
        ("--days", "3000000"),
        ("--days", "9" * 15),
    ],
)
def test_what_no_certificate_can_say_is_wrong_usage_and_nothing_is_made(
    words: tuple[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["keys", "rescue", "--output", str(tmp_path / "keys"), *words])
    assert ended.value.code == 2
    assert f"argument {words[0]}: {words[1]}: expected" in capsys.readouterr().err
    assert not (tmp_path / "keys").exists()


def test_an_address_in_brackets_as_endpoints_have_it_is_that_address(tmp_path: Path) -> None:
    folder = tmp_path / "keys"
    assert main(["keys", "rescue", "--output", str(folder), "--hosts", "[fd00::1]"]) == 0
    content = (folder / "router" / "cert.pem").read_bytes()
    names = x509.load_pem_x509_certificate(content).extensions.get_extension_for_class(
        x509.SubjectAlternativeName
    )
    addresses = names.value.get_values_for_type(x509.IPAddress)
    assert "fd00::1" in {str(address) for address in addresses}


def test_a_certificate_is_no_longer_valid_than_the_authority_that_signed_it(
    tmp_path: Path,
) -> None:
    folder, words = tmp_path / "keys", ["keys", "rescue", "--output"]
    assert main([*words, str(folder), "--robots", "r1", "--days", "2"]) == 0
    assert main([*words, str(folder), "--robots", "r2", "--days", "36500"]) == 0
    authority, first, second = (
        x509.load_pem_x509_certificate((folder / path).read_bytes()).not_valid_after_utc
        for path in ("ca.pem", "robots/r1/cert.pem", "robots/r2/cert.pem")
    )
    assert first < second == authority


def test_who_lost_the_folder_gets_another_certificate_by_the_same_command(folder: Path) -> None:
    before = (folder / "robots" / "r1" / "cert.pem").read_bytes()
    shutil.rmtree(folder / "robots" / "r1")
    assert main(["keys", "rescue", "--output", str(folder)]) == 0
    assert (folder / "robots" / "r1" / "cert.pem").read_bytes() != before


def test_no_name_is_another_s(folder: Path) -> None:
    roster = Roster("rescue", ("ann", "coordinator"), ("ann",), ("ann",))
    names = [member.common_name for member in roster.members]
    assert len(set(names)) == len(names)
    rules = access_rules(roster)
    assert isinstance(rules["policies"], list)
    assert len(rules["policies"]) == len(names)
    assert folder.exists()


def test_a_key_that_others_may_read_is_refused(folder: Path) -> None:
    (folder / "robots" / "r1" / "key.pem").chmod(0o640)
    with pytest.raises(FileError, match="chmod 600"):
        KeyFolder.read(folder / "robots" / "r1")


@pytest.mark.parametrize("name", ["ca.pem", "cert.pem", "key.pem", "member.json"])
def test_what_is_missing_in_a_folder_is_named(folder: Path, name: str) -> None:
    (folder / "robots" / "r1" / name).unlink()
    with pytest.raises(FileError, match=name):
        KeyFolder.read(folder / "robots" / "r1")


def test_the_router_does_not_listen_to_others_without_keys(
    capsys: pytest.CaptureFixture[str],
) -> None:
    for endpoint in ("tcp/0.0.0.0:7447", "tcp/192.168.1.10:7447", "tcp/[::]:7447", "udp/host:1"):
        assert main(["router", "--listen", endpoint]) == 1
        assert "--tls" in capsys.readouterr().err


def test_the_router_takes_no_keys_but_its_own(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["router", "--tls", str(folder / "robots" / "r1")]) == 1
    said = capsys.readouterr().err
    assert "keys of robot r1 of team rescue; expected those of router of team rescue" in said


OTHERS = [
    ("robots/r2", "agent --robot r1 --source - --team rescue", "robot r1 of team rescue"),
    ("robots/r1", "agent --robot r1 --source - --team other", "a member of team other"),
    ("viewers/bob", "server --team rescue", "coordinator of team rescue"),
    ("viewers/bob", "mark r1 victim --at 1,2 --team rescue", "an operator of team rescue"),
    ("robots/r1", "pin r1/0 r2/0 --reason x --team rescue", "an operator of team rescue"),
    ("operators/ann", "forget r1 --reason x --as eve --team rescue", "operator eve of team rescue"),
    ("robots/r2", "send {map} --robot r1 --team rescue", "robot r1 of team rescue"),
    ("viewers/bob", "watch --team other", "a member of team other"),
]


@pytest.mark.parametrize(("whose", "words", "expected"), OTHERS)
def test_keys_with_which_a_program_could_not_do_its_work_are_refused_at_once(
    folder: Path, whose: str, words: str, expected: str, capsys: pytest.CaptureFixture[str]
) -> None:
    # What a router denies it denies in silence: nobody would hear of it.
    a_map = folder / "map.json"
    if "{map}" in words:
        sweep = {"angle_min": -1.5, "angle_increment": 0.01, "ranges": [2.0] * 300}
        (folder / "scans").write_text(json.dumps(sweep))
        assert main(["map", str(folder / "scans"), "--output", str(a_map)]) == 0
    assert main([*words.format(map=a_map).split(), "--tls", str(folder / whose)]) == 1
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert f"; expected those of {expected}\n" in said


def test_a_program_that_feeds_an_agent_is_refused_with_keys_of_another_robot(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MAPWEAVE_TLS", str(folder / "robots" / "r2"))
    with pytest.raises(WrongKeysError, match="robot r1"), Agent("r1", "rescue", patience=1.0):
        pass


def test_orders_are_in_the_name_that_the_keys_say(folder: Path) -> None:
    ann = LinkSettings(KeyFolder.read(folder / "operators" / "ann"))
    coordinator = LinkSettings(KeyFolder.read(folder / "coordinator"))
    assert operator_of(ann, None) == operator_of(ann, "ann") == "ann"
    assert operator_of(coordinator, "eve") == operator_of(LinkSettings(), "eve") == "eve"


SETTINGS = {
    "qos": '{qos: {publication: [{key_exprs: ["**"], config: {congestion_control: "block"}}]}}',
    "mode": '{mode: "peer"}',
    "access_control": '{access_control: {enabled: true, default_permission: "allow"}}',
    "transport/link/tls": "{transport: {link: {tls: {enable_mtls: false}}}}",
    "namespace": '{namespace: "ours"}',
    "adminspace/permissions/write": "{adminspace: {enabled: true, permissions: {write: true}}}",
    "transport/shared_memory": "{transport: {shared_memory: {enabled: true, mode: 'init'}}}",
}


@pytest.mark.parametrize("path", SETTINGS)
def test_settings_that_would_undo_ours_are_refused_with_the_reason(
    tmp_path: Path, path: str
) -> None:
    file = tmp_path / "zenoh.json5"
    file.write_text(SETTINGS[path])
    with pytest.raises(FileError) as told:
        session_config(["tcp/localhost:7447"], link=LinkSettings(extra=file))
    assert str(told.value) == f"{file}: {path}: not to be set here: {OURS[path]}"


def test_other_settings_are_taken_under_ours(tmp_path: Path) -> None:
    file = tmp_path / "zenoh.json5"
    file.write_text('{transport: {unicast: {max_sessions: 7}}, metadata: {name: "base"}}')
    config = session_config(["tcp/localhost:7447"], link=LinkSettings(extra=file))
    assert config.get_json("transport/unicast/max_sessions") == "7"
    assert config.get_json("mode") == '"client"'


def test_a_file_that_is_no_configuration_is_named(tmp_path: Path) -> None:
    file = tmp_path / "zenoh.json5"
    file.write_text("{mode: ")
    for path in (file, tmp_path / "nowhere.json5"):
        with pytest.raises(FileError, match=path.name) as told:
            session_config(["tcp/localhost:7447"], link=LinkSettings(extra=path))
        assert "\n" not in str(told.value)
