"""msgspec learns the types of our files when they are imported: two threads that did so at once crashed the process."""

import subprocess
import sys

_LEARNT = """
import msgspec
learnt = []
decoder = msgspec.json.Decoder
msgspec.json.Decoder = lambda document: learnt.append(document.__name__) or decoder(document)
import calib_core.interchange.own.documents
print(*learnt)
"""


def test_the_types_of_our_files_are_learnt_when_they_are_imported() -> None:
    done = subprocess.run([sys.executable, "-c", _LEARNT], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["ClicksDocument", "PairsDocument", "CalibrationDocument"]
