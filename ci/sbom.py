#!/usr/bin/env python3
"""Writes the packages that both programs are built from on a target, as a CycloneDX 1.5 document.

    ci/sbom.py TARGET >FILE
"""

import json
import subprocess
import sys


def checksums():
    """SHA-256 of the packages from the registry, by name and version."""
    found, entry = {}, {}
    for line in open("Cargo.lock"):
        key, _, value = line.strip().partition(" = ")
        entry = {} if line.startswith("[[") else {**entry, key: value.strip('"')}
        if key == "checksum":
            found[entry["name"], entry["version"]] = entry["checksum"]
    return found


def main():
    target = sys.argv[1]
    command = "cargo tree --locked --edges normal --prefix depth --package grade --package simulate".split()
    tree = subprocess.run([*command, "--target", target, "--format", "|{p}|{l}"], check=True, capture_output=True, text=True).stdout
    sums, components, needs, path = checksums(), {}, {"spring-oracle": set()}, []
    for line in filter(None, tree.splitlines()):
        depth, package, license = line.split("|")
        name, version = package.split()[:2]
        version = version.removeprefix("v")
        reference = f"pkg:cargo/{name}@{version}"
        path[int(depth):] = [reference]
        needs.setdefault(reference, set())
        needs[path[-2] if len(path) > 1 else "spring-oracle"].add(reference)
        license, checksum = license.removesuffix(" (*)").replace("/", " OR "), sums.get((name, version))
        components[reference] = {
            "type": "library", "bom-ref": reference, "name": name, "version": version, "purl": reference,
            "licenses": [{"expression": license}],
            **({"hashes": [{"alg": "SHA-256", "content": checksum}]} if checksum else {}),
        }
        if name == "grade":
            application = {"type": "application", "bom-ref": "spring-oracle", "name": "spring-oracle", "version": version}
    print(json.dumps({
        "bomFormat": "CycloneDX", "specVersion": "1.5", "version": 1,
        "metadata": {"component": application, "properties": [{"name": "target", "value": target}]},
        "components": [components[each] for each in sorted(components)],
        "dependencies": [{"ref": each, "dependsOn": sorted(needs[each])} for each in sorted(needs)],
    }, indent=1))


main()
