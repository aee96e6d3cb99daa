"""``python tests/mutants [WORD ...]`` judges mutants."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from mutants import main

sys.exit(main(*sys.argv[1:]))
