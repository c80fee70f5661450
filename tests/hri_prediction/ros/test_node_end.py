"""A node that was asked to end ends, whatever the middleware does."""

import signal
import subprocess
import sys
import time

HANGS = """
import time
from hri_prediction.ros import node

class Hanging(node.HriNode):
    def __init__(self):
        super().__init__("hanging", period_s=0.1)

    def on_tick(self, now_ns):
        pass

    def close(self):
        print("closed", flush=True)

    def destroy_node(self):
        time.sleep(60.0)

node.TEARDOWN_S = 0.5
raise SystemExit(node.run_node(Hanging))
"""


def test_what_hangs_in_the_end_is_said_and_not_waited_for() -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", HANGS], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert "hanging" in process.stdout.readline()
    begin = time.monotonic()
    process.send_signal(signal.SIGINT)
    out, errors = process.communicate(timeout=20.0)
    assert time.monotonic() - begin < 10.0
    assert out == "closed\n"
    assert "destroy_node" in errors
