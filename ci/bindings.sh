#!/usr/bin/env bash
# The C library's examples, with and without sanitizers, installed and found again, by FetchContent and by pkg-config; the Python module
# with its notebooks in a separate environment.
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
    echo "+ FetchContent"
    mkdir -p "$target/bindings/fetched"
    cat >"$target/bindings/fetched/CMakeLists.txt" <<END
cmake_minimum_required(VERSION 3.18)
project(fetched C CXX)
include(FetchContent)
FetchContent_Declare(spring_oracle SOURCE_DIR "$PWD" SOURCE_SUBDIR bindings/c)
FetchContent_MakeAvailable(spring_oracle)
add_executable(pendulum $PWD/bindings/c/example/pendulum.c)
target_link_libraries(pendulum SpringOracle::spring_oracle)
END
    cmake -S "$target/bindings/fetched" -B "$target/bindings/fetched/build" -DSPRING_ORACLE_TARGET_DIR="$target" >/dev/null
    cmake --build "$target/bindings/fetched/build" >/dev/null
    "$target/bindings/fetched/build/pendulum" | tail -1
    if command -v pkg-config >/dev/null; then
        echo "+ pkg-config spring_oracle"
        export PKG_CONFIG_PATH=$target/bindings/prefix/lib/pkgconfig:$target/bindings/prefix/lib/x86_64-linux-gnu/pkgconfig
        # shellcheck disable=SC2046
        cc bindings/c/example/pendulum.c $(pkg-config --cflags --libs spring_oracle) -o "$target/bindings/pendulum"
        "$target/bindings/pendulum" | tail -1
    else
        echo "bindings: there is no pkg-config: its file is not tried"
    fi
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
    cargo build --release -p grade
    SPRING_ORACLE_GRADE=$target/release/grade "$python" -m pytest -q -rs bindings/python/tests
else
    echo "bindings: there is no python3: the Python module is left out"
fi
echo "bindings: passed"
