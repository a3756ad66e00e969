#!/usr/bin/env bash
# PrairieLearn runs this, in the container, for each submission.
# Tests give other folders.
root="${PRAIRIELEARN_ROOT:-/grade}"
grade="${SPRING_ORACLE:-/opt/spring-oracle/grade}"
results="$root/results/results.json"

# These results remain only if grade cannot write its own.
mkdir -p "$root/results"
cp "$root/tests/not-gradable.json" "$results"

# Here, scenes have short names.
cd "$root/tests/suite" || exit 0

# Ends the run while there is time to write results.
timeout --signal=TERM --kill-after=30 SECONDS_OF_RUN "$grade" "$root/student" ARGUMENTS \
    --no-progress --report text --report prairielearn="$results"
echo "grade ended with exit code $?"
