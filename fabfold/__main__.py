"""``python -m fabfold`` is the command ``fabfold``."""

from fabfold.cli import main

main()
