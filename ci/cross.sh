# For other scripts. `cross COMMAND TARGET ARGUMENTS…` calls cargo for another system. Where rustup has the target, it is
# used; otherwise Debian's rustc-web builds the standard library from rust-web-src.

TARGETS=(x86_64-pc-windows-gnu aarch64-apple-darwin aarch64-unknown-linux-gnu wasm32-wasip1)

# Artefacts of another compiler stay apart.
CROSS_FOLDER=${CROSS_FOLDER:-target/cross}

export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=${CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER:-aarch64-linux-gnu-gcc}
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER=${CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER:-qemu-aarch64 -L /usr/aarch64-linux-gnu}

# need PROGRAM PACKAGE…: installs the packages of Debian whose program is missing; where that fails, the script ends and says so.
need() {
    local missing=()
    while [ $# -gt 0 ]; do
        command -v "$1" >/dev/null || missing+=("$2")
        shift 2
    done
    [ ${#missing[@]} -gt 0 ] || return 0
    echo "+ apt-get install ${missing[*]}"
    if ! { apt-get update -qq && apt-get install -y -qq "${missing[@]}" >/dev/null; }; then
        echo "skipped: not all of ${missing[*]} could be installed"
        exit 0
    fi
}

cross() {
    local command=$1 target=$2
    shift 2
    local flags=() tools=
    if rustc -vV | grep -qx "host: $target" || rustup target list --installed 2>/dev/null | grep -qx "$target"; then
        RUSTFLAGS="${flags[*]}" cargo "$command" --locked --quiet --target "$target" "$@"
        return
    fi
    case $target in
    wasm32-wasip1)
        # Debian's C library of WASI, in the place of the one that rustup brings.
        local clang
        tools=$PWD/$CROSS_FOLDER/tools
        clang=$(compgen -c clang- | sort -V | grep -m1 -E '^clang-[0-9]+$')
        mkdir -p "$tools"
        "$clang" --target=wasm32-wasi -isystem /usr/include/wasm32-wasi -Os -c web/compat.c -o "$tools/compat.o"
        # A library has no entry.
        printf '#!/bin/sh\ncase " $* " in *" --no-entry "*) start=reactor ;; *) start=command ;; esac\n%s\n' \
            "exec $(PATH=${PATH#$tools:} command -v wasm-ld) \"\$@\" --strip-all $tools/compat.o /usr/lib/wasm32-wasi/crt1-\$start.o" \
            >"$tools/wasm-ld"
        chmod +x "$tools/wasm-ld"
        flags=(-C linker-flavor=wasm-ld -C linker=wasm-ld -C link-self-contained=no
            -C link-arg=-L/usr/lib/wasm32-wasi) ;;
    esac
    PATH=${tools:+$tools:}$PATH RUSTC_BOOTSTRAP=1 RUSTC=/usr/bin/rustc RUSTFLAGS="${flags[*]}" CARGO_TARGET_DIR=$CROSS_FOLDER \
        CARGO_PROFILE_RELEASE_PANIC=abort CARGO_PROFILE_DIST_PANIC=abort CARGO_PROFILE_DEV_PANIC=abort \
        /usr/bin/cargo "$command" --locked --quiet --target "$target" -Zbuild-std=std,panic_abort -Zpanic-abort-tests "$@"
}

# same_traces COMMAND…: how many traces of this simulator have the bytes of the stored ones, and the names of the others.
same_traces() {
    local same=0 differs=() expected name scene
    local trace=target/trace.csv
    while read -r expected; do
        name=${expected#expected/}
        name=${name%.csv}
        for scene in {assets,extracreditassets}/"$name".{xml,json}; do
            [ ! -f "$scene" ] || break
        done
        "$@" "$scene" -o $trace >/dev/null 2>&1 </dev/null || rm -f $trace
        if cmp -s $trace "$expected"; then same=$((same + 1)); else differs+=("$name"); fi
    done < <(find expected -name '*.csv' | sort)
    echo "$same traces have the same bytes as the oracle's"
    [ ${#differs[@]} -eq 0 ] || printf '  differs: %s\n' "${differs[@]}"
}
