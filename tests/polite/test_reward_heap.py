"""glibc keeps what a training frees."""

import platform
import subprocess
import sys

import pytest

SCRIPT = """
import resource
import torch
from polite.rewards.heap import keep_freed_memory


def faults():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(20):
        results = [torch.zeros(2**18) for _ in range(8)]  # 8 MiB, written to
        del results
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before


first = faults()
keep_freed_memory()
faults()  # the pages are handed out once more
print(first, faults())
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="other C libraries have other rules")
def test_pages_are_not_handed_out_again_and_again():
    run = subprocess.run([sys.executable, "-c", SCRIPT], check=True, capture_output=True, text=True)
    before, after = map(int, run.stdout.split())
    assert before > 1000
    assert after < 100
