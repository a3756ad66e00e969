#!/usr/bin/env bash
# The C library's examples, with and without sanitizers, installed and found again; the Python module in an environment of its own.
set -euo pipefail
cd "$(dirname "$0")/.."

target=${CARGO_TARGET_DIR:-$PWD/target}
if command -v cmake >/dev/null; then
    for sanitize in OFF ON; do
        build=$target/bindings/sanitize-$sanitize
        echo "+ ctest of bindings/c, SPRING_ORACLE_SANITIZE=$sanitize"
        cmake -S bindings/c -B "$build" -DCMAKE_BUILD_TYPE=Release -DSPRING_ORACLE_SANITIZE=$sanitize \
            -DSPRING_ORACLE_TARGET_DIR="$target" -DCMAKE_INSTALL_PREFIX="$target/bindings/prefix" >/dev/null
        cmake --build "$build" >/dev/null
        ctest --test-dir "$build" --output-on-failure
    done
    cmake --install "$target/bindings/sanitize-OFF" >/dev/null
    echo "+ find_package(SpringOracle)"
    mkdir -p "$target/bindings/found"
    cat >"$target/bindings/found/CMakeLists.txt" <<END
cmake_minimum_required(VERSION 3.16)
project(found C)
find_package(SpringOracle REQUIRED)
add_executable(pendulum $PWD/bindings/c/example/pendulum.c)
target_link_libraries(pendulum SpringOracle::spring_oracle)
END
    cmake -S "$target/bindings/found" -B "$target/bindings/found/build" -DCMAKE_PREFIX_PATH="$target/bindings/prefix" >/dev/null
    cmake --build "$target/bindings/found/build" >/dev/null
    "$target/bindings/found/build/pendulum" | tail -1
else
    echo "bindings: there is no cmake: the examples in C and C++ are left out"
fi

if command -v python3 >/dev/null; then
    echo "+ pip install bindings/python, pytest"
    [ -d "$target/bindings/python" ] || python3 -m venv "$target/bindings/python"
    python=$target/bindings/python/bin/python
    if ! CARGO_TARGET_DIR=$target/bindings/cargo "$python" -m pip install --quiet "./bindings/python[test]"; then
        echo "bindings: the Python module could not be installed"
        exit 1
    fi
    "$python" -m pytest -q -rs bindings/python/tests
else
    echo "bindings: there is no python3: the Python module is left out"
fi
echo "bindings: passed"
