"""Random input, the same in every run: few cases by hypothesis, which makes what fails small, or very many without."""

import random
import re
from pathlib import Path

from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st

MOST_GROWTH = 50_000  # kB
USUAL = settings.get_profile("rigid_body_sim").max_examples


def fuzz(record_property, check, make, cases):
    """Give ``check`` what ``make`` makes of a source of chance, ``cases`` times.

    With the profile ``nightly``, many times as often and without hypothesis, which takes most of the time: what fails
    then names the seed, and memory must not grow. The number of cases is added up at the end of the run.
    """
    total = cases * settings.default.max_examples // USUAL
    if total > cases:
        _try_many(check, make, total)
    else:
        limits = settings(max_examples=cases, database=None, deadline=None, suppress_health_check=list(HealthCheck))
        cases_of = given(st.randoms(use_true_random=False).map(make))
        seed(1)(limits(cases_of(lambda case: check(case))))()
    record_property("cases", total)


def _try_many(check, make, total):
    for number in range(total):
        _try(check, make, number)
        if number == total // 10:
            begin = memory()
    grown = memory() - begin
    print(f"memory grown by {grown} kB over {total - total // 10} cases")
    assert grown < MOST_GROWTH


def memory():
    """Memory that this process holds [kB]."""
    return int(re.search(r"VmRSS:\s+(\d+)", Path("/proc/self/status").read_text()).group(1))


def _try(check, make, number):
    case = make(random.Random(number))
    try:
        check(case)
    except BaseException:
        print(f"random.Random({number}) made {case!r}")
        raise


def often(chance):
    """Four times in five."""
    return chance.random() < 0.8


def damaged(chance, data):
    """Bytes that are cut, lengthened, changed in some places, or have a part twice or moved."""
    how = chance.randrange(5)
    a, b = sorted(chance.randint(0, len(data)) for _ in range(2))
    if how == 0:
        return data[:a]
    if how == 1:
        return data + bytes(chance.getrandbits(8) for _ in range(chance.randint(0, 40)))
    if how == 2:
        return data[:a] + data[a:b] * 2 + data[b:]
    if how == 3:
        return data[:a] + data[b:]
    changed = bytearray(data)
    for _ in range(chance.randint(1, 5) if data else 0):
        changed[chance.randrange(len(data))] = chance.choice((chance.getrandbits(8), 0, 0x7F, 0xFF))
    return bytes(changed)


def sentence(text, most=2000):
    """Assert that a message is one line, of a length that somebody reads, with plain lists, and return it."""
    text = str(text)
    assert text.isprintable(), f"more than one line, or control characters: {text!r}"
    assert 10 < len(text) < most, f"{len(text)} characters: {text[:most]!r}"
    assert not re.search(r"array\(|\bnp\.|(?<!\w)\(-?(\d+(\.|e)|inf|nan)[-+.\w]*,", text), f"no plain list: {text!r}"
    return text
