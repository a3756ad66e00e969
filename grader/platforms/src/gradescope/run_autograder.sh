#!/usr/bin/env bash
# Gradescope runs this, as root, for each submission. It shows what this prints to instructors only.
# Tests give another folder than Gradescope's.
root="${AUTOGRADER_ROOT:-/autograder}"
source="$root/source"
results="$root/results/results.json"

# These results remain only if grade cannot write its own.
mkdir -p "$root/results"
# Submissions run as another user, and have no business with either.
chmod 700 "$root/results"
chmod -f 600 "$root/submission_metadata.json"
cp "$source/not-graded.json" "$results"

# Here, scenes have short names.
cd "$source/suite"

# Ends the run while there is time to write results: Gradescope stops it later without any.
timeout --signal=TERM --kill-after=30 SECONDS_OF_RUN "$source/grade" "$root/submission" ARGUMENTS \
    --metadata "$root/submission_metadata.json" \
    --no-progress --report text --report gradescope="$results"
echo "grade ended with exit code $?"
