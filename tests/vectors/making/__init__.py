"""What ``make.py`` is made of: binary64 in integers, the rules, whole runs, and what is asked."""
