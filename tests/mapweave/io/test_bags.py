"""ROS bags: the same scans whatever the form, and all whole ones of a bag that was cut off."""

import gzip
import math
import shutil
import sqlite3
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import IndexType, Writer

from mapweave.errors import FileError, MissingExtraError
from mapweave.io.readers import count_scans, read_scans
from mapweave.io.readers.ros_bags import bags, db3, mcap, ros1_bag
from mapweave.io.readers.ros_bags.laser_messages import LASER_SCAN
from mapweave.scan.scan import Scan
from tests.mapweave.io.bag_files import ROS1, ROS2, Laser, lasers, write_bag, write_recording

FORMS = ["bag", "db3", "mcap"]
NO_MESSAGE_INDEX = IndexType.ALL & ~IndexType.MESSAGE
COMPRESSED = [("bag", "bz2"), ("bag", "lz4"), ("mcap", "storage")]


def write(folder: Path, form: str, topics: dict[str, list[Laser]], compression: str = "") -> Path:
    if form == "bag":
        return write_bag(folder / "some.bag", topics, compression)
    return write_recording(folder / "some", topics, form, compression)


def same(one: list[Scan], other: list[Scan]) -> bool:
    """Whether scans are the same to the last bit."""
    return len(one) == len(other) and all(
        a.ranges.tobytes() == b.ranges.tobytes()
        and a.angles.tobytes() == b.angles.tobytes()
        and (a.index, a.stamp) == (b.index, b.stamp)
        for a, b in zip(one, other, strict=True)
    )


def rewrite(path: Path, options: dict[str, Any]) -> None:
    """Write the messages of an MCAP again, some in a chunk, by other options of the recorder."""
    with path.open("rb") as file:
        found = list(make_reader(file).iter_messages())
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=10_000, **options)
        writer.start(profile="ros2")
        schema, channel, _ = found[0]
        assert schema is not None
        number = writer.register_schema(schema.name, schema.encoding, schema.data)
        topic = writer.register_channel(channel.topic, channel.message_encoding, number)
        for _, _, message in found:
            writer.add_message(topic, message.log_time, message.data, message.publish_time)
        writer.finish()  # type: ignore[no-untyped-call]


def cut(path: Path, size: int) -> Path:
    """Return a copy of the first `size` bytes, in a folder of its own."""
    folder = path.parent / f"cut{size}"
    folder.mkdir()
    copy = folder / path.name
    copy.write_bytes(path.read_bytes()[:size])
    return copy


@pytest.mark.parametrize("form", FORMS)
def test_a_scan_of_a_bag_is_what_was_published(form: str, tmp_path: Path) -> None:
    laser = Laser(np.array([1.5, 0.05, math.inf, math.nan, 0.0, 10.0, 11.0, 2.25]))
    (scan,) = read_scans(write(tmp_path, form, {"/scan": [laser]}))
    np.testing.assert_array_equal(scan.ranges, [1.5, *[math.nan] * 6, 2.25])
    start, step = np.float64(np.float32(-1.0)), np.float64(np.float32(laser.angle_increment))
    np.testing.assert_array_equal(scan.angles, start + step * np.arange(8))
    assert (scan.stamp, scan.index, scan.odometry) == (100.25, 0, None)


@pytest.mark.parametrize("form", FORMS)
def test_a_sensor_that_turns_clockwise_is_turned_round(form: str, tmp_path: Path) -> None:
    laser = Laser(np.array([1.0, 2.0, 3.0]), angle_min=0.5, angle_increment=-0.5)
    (scan,) = read_scans(write(tmp_path, form, {"/scan": [laser]}))
    assert scan.ranges.tolist() == [3.0, 2.0, 1.0]
    assert scan.angles.tolist() == [-0.5, 0.0, 0.5]


@pytest.mark.parametrize("maximum", [0.0, math.nan, -1.0, math.inf])
def test_a_maximum_that_is_no_distance_states_nothing(maximum: float, tmp_path: Path) -> None:
    laser = Laser(np.array([1.0, 200.0]), range_max=maximum, range_min=math.nan)
    (scan,) = read_scans(write(tmp_path, "mcap", {"/scan": [laser]}))
    assert scan.ranges.tolist() == [1.0, 200.0]


def test_all_forms_hold_the_same_scans_to_the_last_bit(tmp_path: Path) -> None:
    topics, forms = {"/scan": lasers(30)}, []
    for form in FORMS:
        (tmp_path / form).mkdir()
        forms.append(write(tmp_path / form, form, topics))
    first, *others = [list(read_scans(form)) for form in forms]
    assert len(first) == 30
    assert all(same(first, other) for other in others)


@pytest.mark.parametrize("form", ["db3", "mcap"])
@pytest.mark.parametrize("compression", ["", "message", "file"])
def test_a_folder_is_read_as_its_file_is(form: str, compression: str, tmp_path: Path) -> None:
    topics = {"/scan": lasers(20)}
    write(tmp_path, form, topics, compression)
    (tmp_path / "plain").mkdir()
    alone = write(tmp_path / "plain", form, topics)
    assert same(list(read_scans(tmp_path / "some")), list(read_scans(alone)))


@pytest.mark.parametrize("form", ["db3", "mcap"])
def test_a_folder_without_metadata_gives_its_files_in_order(form: str, tmp_path: Path) -> None:
    folder, scans = tmp_path / "recording", lasers(12)
    folder.mkdir()
    for part in range(12):
        file = write_recording(tmp_path / str(part), {"/scan": [scans[part]]}, form)
        shutil.copyfile(file, folder / f"part_{part}{file.suffix}")
    with pytest.warns(UserWarning, match="all have the stamp 100"):  # each is the first of its file
        read = [scan.ranges.astype(np.float32).tolist() for scan in read_scans(folder)]
    assert read == [scan.ranges.astype(np.float32).tolist() for scan in scans]
    assert count_scans(folder) == 12


@pytest.mark.parametrize(
    "options",
    [
        {"index_types": NO_MESSAGE_INDEX},
        {"index_types": NO_MESSAGE_INDEX, "use_statistics": False},
        {"repeat_channels": False},
        {"repeat_schemas": False},
        {"repeat_channels": False, "repeat_schemas": False, "use_chunking": False},
    ],
)
def test_what_the_index_does_not_tell_is_read_all_the_same(
    options: dict[str, Any], tmp_path: Path
) -> None:
    path = write(tmp_path, "mcap", {"/scan": lasers(60, beams=200)})
    whole = list(read_scans(path))
    rewrite(path, options)
    for place in (path, path.parent):
        assert same(list(read_scans(place)), whole)
    # Without a summary worth the name `rosbags` looks for itself.
    with mcap.open_whole(path) as reader:
        assert mcap.is_indexed(reader) == (options.get("use_chunking") is False)


@pytest.mark.parametrize("form", FORMS)
def test_its_content_tells_what_it_is_not_its_name(form: str, tmp_path: Path) -> None:
    path = write(tmp_path, form, {"/scan": lasers(3)})
    renamed = path.rename(path.with_name("recording"))
    assert count_scans(renamed) == 3


@pytest.mark.parametrize("form", FORMS)
def test_of_several_lasers_one_has_to_be_named(form: str, tmp_path: Path) -> None:
    path = write(tmp_path, form, {"/front": lasers(3), "/rear": lasers(2)})
    with pytest.raises(FileError, match=r"has several lasers, /front \(3 .*, /rear \(2 .*--topic"):
        count_scans(path)
    assert [count_scans(path, topic=name) for name in ("/front", "rear")] == [3, 2]
    with pytest.raises(FileError, match=r"no laser scans on topic /scan; there are /front \(3"):
        count_scans(path, topic="/scan")


def test_of_two_lasers_at_one_topic_the_first_is_read_and_the_other_told_of(tmp_path: Path) -> None:
    front, rear = lasers(6)[::2], lasers(6)[1::2]
    both = [
        each for f, r in zip(front, rear, strict=True) for each in (f, replace(r, frame="rear"))
    ]
    path = write(tmp_path, "mcap", {"/scan": both})
    with pytest.warns(
        UserWarning, match="what /scan has in frame 'rear' is of another laser, left"
    ):
        read = list(read_scans(path))
    alone = list(read_scans(write(tmp_path / "alone", "mcap", {"/scan": front})))
    assert [r.ranges.tolist() for r in read] == [a.ranges.tolist() for a in alone]
    assert [scan.index for scan in read] == [0, 1, 2]


@pytest.mark.parametrize("form", FORMS)
def test_of_a_beam_that_came_back_several_times_the_first_echo_counts(
    form: str, tmp_path: Path
) -> None:
    once = lasers(5)
    twice = [replace(scan, beyond=np.linspace(0.3, 2.0, len(scan.ranges))) for scan in once]
    path = write(tmp_path, form, {"/multi": twice})
    read = list(read_scans(path))
    (tmp_path / "alone").mkdir()
    alone = list(read_scans(write(tmp_path / "alone", form, {"/scan": once})))
    assert all(math.isnan(scan.ranges[0]) for scan in read)
    assert [r.ranges[1:].tolist() for r in read] == [a.ranges[1:].tolist() for a in alone]
    assert count_scans(cut(path, path.stat().st_size - 40), topic="/multi") > 0


def test_a_laser_whose_frame_has_another_name_after_a_while_is_the_same(tmp_path: Path) -> None:
    before, after = lasers(8)[:4], [replace(each, frame="base_laser") for each in lasers(12)[4:]]
    path = write(tmp_path, "mcap", {"/scan": before + after})
    with pytest.warns(UserWarning, match="in frame 'base_laser' is of another laser, left out"):
        assert len(list(read_scans(path))) == 12 - 5  # five seconds of it: it might have been two


@pytest.mark.parametrize("form", FORMS)
def test_a_bag_without_a_laser_is_refused(form: str, tmp_path: Path) -> None:
    with pytest.raises(FileError, match="holds no laser scan; expected a ROS bag"):
        count_scans(write(tmp_path, form, {"/scan": []}))


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("part", [0.2, 0.5, 0.77, 0.98])
def test_a_bag_that_was_cut_off_gives_all_whole_messages_and_one_warning(
    form: str, part: float, tmp_path: Path
) -> None:
    scans = lasers(900, beams=150)
    whole = write(tmp_path, form, {"/scan": scans})
    copy = cut(whole, int(whole.stat().st_size * part))
    warnings: list[str] = []
    found = list(read_scans(copy, on_warning=warnings.append))
    there = copy.read_bytes()
    serialized = [
        ROS1.serialize_ros1(scan.message(number, ros1=True), LASER_SCAN)
        if form == "bag"
        else ROS2.serialize_cdr(scan.message(number), LASER_SCAN)
        for number, scan in enumerate(scans)
    ]
    # A row of SQLite may continue in other pages, so what is there is not there in one piece.
    expected = sum(bytes(data) in there for data in serialized)
    assert expected >= 0.1 * len(scans)
    assert len(found) >= expected
    assert form == "db3" or len(found) == expected
    assert [scan.index for scan in found] == list(range(len(found)))
    of_stamp = {scan.stamp: scan for scan in read_scans(whole)}
    # The first rows of a page of SQLite lie at its end: of the page that was cut they are missing.
    assert all(
        np.array_equal(scan.ranges, of_stamp[scan.stamp].ranges, equal_nan=True) for scan in found
    )
    (warning,) = warnings
    assert f"is cut off or was not closed: its {len(found)} whole scans were read" in warning


@pytest.mark.parametrize(("form", "compression"), COMPRESSED)
def test_what_can_be_unpacked_of_a_cut_chunk_is_used(
    form: str, compression: str, tmp_path: Path
) -> None:
    whole = write(tmp_path, form, {"/scan": lasers(2000, beams=300)}, compression)
    copy = cut(whole, int(whole.stat().st_size * 0.7))
    found = list(read_scans(copy, on_warning=lambda _: None))
    block = 700 if compression == "bz2" else 100  # a block of bzip2 is there whole or not at all
    assert 1400 - block < len(found) < 1450
    assert same(found, list(read_scans(whole))[: len(found)])


@pytest.mark.parametrize("form", FORMS)
def test_the_walk_through_a_whole_bag_finds_what_its_index_does(form: str, tmp_path: Path) -> None:
    topics = {"/front": lasers(40, beams=2000), "/rear": lasers(7)}
    path = write(tmp_path, form, topics)
    found = {"bag": ros1_bag, "db3": db3, "mcap": mcap}[form].FORMAT
    assert found.is_whole(path)
    with found.open_whole(path) as reader:
        whole = bags.WholeBag(reader, found.encoding)
        walked = bags.CutBag(path, found.walk)
        assert walked.lasers() == whole.lasers() == {"/front": 40, "/rear": 7}
        for topic in topics:
            assert list(walked.scans(topic)) == list(whole.scans(topic))


def test_a_folder_of_which_a_file_was_cut_off_gives_what_is_whole(tmp_path: Path) -> None:
    path = write(tmp_path, "mcap", {"/scan": lasers(300, beams=300)})
    path.write_bytes(path.read_bytes()[:100_000])
    with pytest.warns(UserWarning, match="was not closed"):
        assert 50 < len(list(read_scans(path.parent))) < 90


def test_messages_that_sqlite_had_still_to_move_into_its_file_are_read(tmp_path: Path) -> None:
    path = write(tmp_path, "db3", {"/scan": lasers(20)})
    killed = tmp_path / "killed.db3"
    with sqlite3.connect(path) as database:
        database.execute("PRAGMA journal_mode=WAL")
        database.execute(
            "INSERT INTO messages (topic_id, timestamp, data)"
            " SELECT topic_id, timestamp + 1, data FROM messages"
        )
        database.commit()
        for suffix in ("", "-wal"):
            shutil.copyfile(f"{path}{suffix}", f"{killed}{suffix}")
    database.close()
    before = killed.read_bytes()
    with pytest.warns(UserWarning, match="was not closed: its 40 whole scans"):
        assert len(list(read_scans(killed))) == 40
    assert killed.read_bytes() == before


def test_a_message_that_is_no_scan_is_left_out_and_told_once(tmp_path: Path) -> None:
    scans = [*lasers(2), Laser(np.ones(3), angle_increment=0.0), *lasers(1)]
    path = write(tmp_path, "mcap", {"/scan": scans})
    with pytest.warns(UserWarning, match="dropped 1 damaged message, the first message 3: angle"):
        found = list(read_scans(path))
    assert [scan.index for scan in found] == [0, 1, 2]


def test_a_packed_bag_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path, "bag", {"/scan": lasers(1)})
    packed = tmp_path / "some.bag.gz"
    packed.write_bytes(gzip.compress(path.read_bytes()))
    with pytest.raises(FileError, match="is a packed bag; expected it unpacked"):
        count_scans(packed)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("size", [16, 60, 200])
def test_a_bag_of_which_hardly_anything_is_left_is_refused(
    form: str, size: int, tmp_path: Path
) -> None:
    path = cut(write(tmp_path, form, {"/scan": lasers(5)}), size)
    with pytest.raises(FileError, match="is cut off or was not closed; holds no laser scan"):
        count_scans(path)


@pytest.mark.parametrize("form", FORMS)
def test_noise_in_a_bag_is_no_traceback(form: str, tmp_path: Path) -> None:
    path = write(tmp_path, form, {"/scan": lasers(60)})
    content, generator = bytearray(path.read_bytes()), np.random.default_rng(3)
    for _ in range(40):
        spoilt = content.copy()
        for place in generator.integers(20, len(content), 30):
            spoilt[place] = generator.integers(256)
        path.write_bytes(spoilt)
        try:
            assert len(list(read_scans(path, on_warning=lambda _: None))) <= 120
        except FileError as error:
            assert "\n" not in str(error)


@pytest.mark.parametrize("whole", [True, False], ids=["whole", "cut off"])
@pytest.mark.parametrize("form", [*FORMS, "folder of db3", "folder of mcap"])
def test_without_rosbags_every_bag_names_the_extra(
    form: str, whole: bool, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    file = write(tmp_path, form.split()[-1], {"/scan": lasers(20)})
    if not whole:
        file.write_bytes(file.read_bytes()[:-2000])
    for name in [name for name in sys.modules if name.partition(".")[0] in ("rosbags", "apsw")]:
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(MissingExtraError, match=r"mapweave\[bags\]"):
        count_scans(file.parent if form.startswith("folder") else file)


@pytest.mark.parametrize("topic", ["/front_scan", "/rear_scan"])
def test_three_forms_of_a_real_recording_are_the_same(
    topic: str, data_dir: Path, tmp_path: Path
) -> None:
    alone = [data_dir / "tysik_db3" / "tysik_db3.db3", data_dir / "tysik_mcap" / "tysik_mcap.mcap"]
    bare = tmp_path / "bare"
    bare.mkdir()
    shutil.copyfile(alone[0], bare / alone[0].name)
    forms = [data_dir / "tysik_scans_demo.bag", *(path.parent for path in alone), *alone, bare]
    first, *others = [list(read_scans(form, topic=topic)) for form in forms]
    assert len(first) == {"/front_scan": 331, "/rear_scan": 330}[topic]
    assert all(same(first, other) for other in others)
