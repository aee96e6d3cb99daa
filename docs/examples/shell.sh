# A session in a shell: results go through pipes, each run adds a row to a table, and exit codes decide.
# Run it by: sh docs/examples/shell.sh
set -e
cd "$(mktemp -d)"

# Contacts to a program that reads lines; the last two lines are the fingerprint and the clock.
kinetile run cradle --until 3 --contacts - | tee contacts.txt | kinetile certify-log cradle - --until 3
tail -n 2 contacts.txt | cut -c 1-30

# A table of runs: the head once, then one row a seed.
for seed in 1 2; do
    kinetile run grid -s bodies=9 -s seed=$seed --broad-phase naive --max-contacts 1e2 --csv | tail -n +$seed
done > rows.csv
wc -l < rows.csv

# A log that is ASCII, and a command that is quiet unless it fails.
PYTHONIOENCODING=ascii kinetile compare cradle --phases naive,cells --until 3 | tail -n 1
if kinetile run cradle --until 3 --quiet; then echo "no fault"; fi
