"""While an agent waits for its tick, other threads of the script run."""

import json

import shoal

TEXT = """
import json, sys, threading, time
import shoal

count, runs = 0, True

def counts():
    global count
    while runs:
        time.sleep(0.002)
        count += 1

thread = threading.Thread(target=counts, daemon=True)
thread.start()
begun = time.monotonic()
shoal.run(lambda view: (1.0, 0.0))
runs = False
if "--slot" in sys.argv and sys.argv[sys.argv.index("--slot") + 1] == "0":
    with open({path!r}, "w") as file:
        json.dump([count, time.monotonic() - begun], file)
"""


def test_other_threads_run_while_an_agent_waits(lanes, script, tmp_path):
    path = tmp_path / "count.json"
    shoal.launch(lanes, agent=script("threads.py", TEXT.format(path=str(path))), mode="realtime", duration_s=3)
    count, took_s = json.loads(path.read_text())
    # With the lock held it would hardly run at all.
    assert count > 100 * took_s, (count, took_s)
