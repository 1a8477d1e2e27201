"""The recorder: everything put in is in the bag, in its order, or it is counted as dropped."""

import itertools
import resource
import threading
import time

import pytest

from rigid_body_sim import Wrench
from rigid_body_sim.bags import journal
from rigid_body_sim.bags.recorder import Recorder
from rigid_body_sim.bags.writing import CHUNK_BYTES, Topic

pytest.importorskip("rosbags")

TOPICS = [Topic("/pose", "geometry_msgs/msg/PoseStamped"), Topic("/wrench", "geometry_msgs/msg/WrenchStamped")]
SECONDS = 20.0
TINY = 5000  # bytes of room: 25 messages


def data(number):
    return number.to_bytes(100, "little")


def contents(folder):
    """(topic, log time, bytes) of each message of a closed bag."""
    from rosbags.highlevel import AnyReader

    with AnyReader([folder]) as reader:
        return [(connection.topic, time_ns, bytes(found)) for connection, time_ns, found in reader.messages()]


def entries(folder):
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    texts = [store.deserialize_cdr(found, journal.TYPE).data for topic, _, found in contents(folder) if topic == "/j"]
    return journal.read(texts)


def wait(condition):
    deadline = time.monotonic() + SECONDS
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_everything_is_there_in_the_order_of_coming(tmp_path):
    recorder = Recorder(tmp_path / "bag", TOPICS, "/j")
    began_ns = time.time_ns()
    for number in range(20_000):
        recorder.put(number % 2, data(number))
        if number % 100 == 0:
            recorder.put_entry(number, "set_wrench", {"wrench": Wrench((1.0, 2.0, 3.0)), "hold": None, "source": "a"})
    recorder.close()
    found = contents(tmp_path / "bag")
    sent = [message for message in found if message[0] != "/j"]
    assert sent == [(TOPICS[i % 2].name, sent[i][1], data(i)) for i in range(20_000)]
    times = [time_ns for _, time_ns, _ in found]
    assert all(a < b for a, b in itertools.pairwise(times))
    assert abs(times[0] - began_ns) < 60e9
    assert [entry.step for entry in entries(tmp_path / "bag")] == list(range(0, 20_000, 100))
    assert [(entry.time_ns) for entry in entries(tmp_path / "bag")] == [t for topic, t, _ in found if topic == "/j"]
    assert (recorder.recorded, recorder.dropped, recorder.failure) == (len(found), 0, "")


def test_what_finds_no_room_is_counted(tmp_path):
    recorder = Recorder(tmp_path / "bag", TOPICS, "/j", capacity=TINY)
    for number in range(20_000):
        recorder.put(0, data(number))
    recorder.close()
    found = [int.from_bytes(message, "little") for _, _, message in contents(tmp_path / "bag")]
    assert recorder.dropped > 0
    assert recorder.recorded == len(found) == 20_000 - recorder.dropped
    assert found == sorted(found)
    assert found[:25] == list(range(25))


def test_who_has_time_waits_for_room(tmp_path):
    recorder = Recorder(tmp_path / "bag", TOPICS, "/j", lambda: True, capacity=TINY)
    for number in range(1000):
        recorder.put(0, data(number))
    recorder.close()
    assert [int.from_bytes(message, "little") for _, _, message in contents(tmp_path / "bag")] == list(range(1000))
    assert recorder.dropped == 0


@pytest.mark.parametrize("is_patient", (False, True))
def test_message_larger_than_the_buffer_is_the_only_one_lost(tmp_path, is_patient):
    """Nobody waits for room that cannot be, and nobody later is punished for it."""
    capacity = TINY if is_patient else 10**7  # the other one has room for all
    recorder = Recorder(tmp_path / "bag", TOPICS, "/j", lambda: is_patient, capacity=capacity)
    for number in range(1000):
        if number % 500 == 10:
            recorder.put(1, bytes(capacity))
        recorder.put(0, data(number))
    recorder.close()
    assert [int.from_bytes(message, "little") for _, _, message in contents(tmp_path / "bag")] == list(range(1000))
    assert (recorder.recorded, recorder.dropped) == (1000, 2)
    assert recorder.too_large == (
        f"a message of {capacity} bytes on /wrench is not recorded: the recorder's buffer has {capacity} bytes; all "
        "others are recorded"
    )


def test_patience_comes_back_with_the_disk(tmp_path, monkeypatch):
    """A disk that hangs once loses what comes while it does, and nothing afterwards."""
    monkeypatch.setattr("rigid_body_sim.bags.recorder._PATIENCE", 0.05)
    recorder = Recorder(tmp_path / "bag", TOPICS, "/j", lambda: True, capacity=TINY)
    hangs, write = threading.Event(), recorder._writer.write
    hangs.set()

    def slow(messages):
        wait(lambda: not hangs.is_set())
        write(messages)

    monkeypatch.setattr(recorder._writer, "write", slow)
    for number in range(100):
        recorder.put(0, data(number))
    lost = recorder.dropped
    assert lost > 50
    hangs.clear()
    wait(lambda: recorder._room_taken == recorder._room_freed)
    for number in range(100, 1100):
        recorder.put(0, data(number))
    recorder.close()
    assert recorder.dropped == lost
    found = [int.from_bytes(message, "little") for _, _, message in contents(tmp_path / "bag")]
    assert found[-1000:] == list(range(100, 1100))


def test_hole_in_the_journal_is_written_down_where_it_is(tmp_path):
    """Entries still find room where messages do not; when that is taken, too, one says so."""
    recorder = Recorder(tmp_path / "bag", TOPICS, "/j", capacity=TINY)
    put = 0
    while recorder.dropped < 7:
        recorder.put_entry(put, "clear_wrench", {})
        put += 1
    wait(lambda: recorder.recorded > 0)
    recorder.put_entry(put, "clear_wrench", {})
    recorder.close()
    found = entries(tmp_path / "bag")
    kept = [entry.step for entry in found if entry.call == "clear_wrench"]
    holes = [entry.step for entry in found if entry.call == journal.LOST]
    assert kept == sorted(kept)
    assert len(kept) == put + 1 - 7
    missing = set(range(put + 1)) - set(kept)
    assert holes == [step for step in sorted(missing) if step - 1 not in missing]


def test_full_disk_ends_it_with_a_sentence(tmp_path):
    recorder = Recorder(tmp_path / "bag", TOPICS, "/j", lambda: True)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (8 * CHUNK_BYTES, before[1]))
    try:
        for number in range(30_000):
            recorder.put(0, data(number))
        wait(lambda: recorder.failure)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    recorder.put(0, data(1))
    recorder.close()
    assert recorder.failure == (
        f"recording to {tmp_path}/bag has stopped ([Errno 27] File too large), and the simulation goes on; what was "
        "written before can be read"
    )
    assert recorder.recorded > 5000
    assert recorder.recorded + recorder.dropped == 30_001
