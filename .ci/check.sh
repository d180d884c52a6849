#!/usr/bin/env bash
# Checks the project in $1 with the exercises in EXERCISES. Writes annotations to stdout, the result to the job summary
# (indented, so that text of the firmware cannot end the code block), and a JUnit file into RUNNER_TEMP.
set -uo pipefail
folder=$1
junit="$RUNNER_TEMP/fcu-junit.xml"
screen="$RUNNER_TEMP/fcu-check.txt"
options=()
read -r -a names <<< "${EXERCISES:-}"
for name in "${names[@]}"; do options+=(--exercise "$name"); done
echo "junit=$junit" >> "$GITHUB_OUTPUT"
fcu check --annotations github --json "$RUNNER_TEMP/fcu-verdict.json" --junit "$junit" "${options[@]}" -- "$folder" | tee "$screen"
code=${PIPESTATUS[0]}
{
    echo "### fcu check"
    echo
    grep -v '^::' "$screen" | sed 's/^/    /'
} >> "$GITHUB_STEP_SUMMARY"
exit "$code"
