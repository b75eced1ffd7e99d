"""A CycloneDX 1.5 list of what `cargo metadata` tells on standard input, checksums from Cargo.lock."""

import json
import sys
import tomllib
from pathlib import Path


def main() -> None:
    metadata = json.load(sys.stdin)
    lock = tomllib.loads(Path("Cargo.lock").read_text())
    checksums = {(p["name"], p["version"]): p.get("checksum") for p in lock["package"]}
    reference = {p["id"]: f"pkg:cargo/{p['name']}@{p['version']}" for p in metadata["packages"]}
    components = []
    for package in sorted(metadata["packages"], key=lambda p: reference[p["id"]]):
        name, version = package["name"], package["version"]
        component = {
            "type": "library",
            "bom-ref": reference[package["id"]],
            "name": name,
            "version": version,
            "purl": reference[package["id"]],
            "description": package["description"] or "",
            # Old crates write "A/B" for "A OR B".
            "licenses": [{"expression": (package["license"] or "").replace(" / ", " OR ").replace("/", " OR ")}],
        }
        if checksum := checksums.get((name, version)):
            component["hashes"] = [{"alg": "SHA-256", "content": checksum}]
        components.append(component)
    dependencies = [
        {"ref": reference[node["id"]], "dependsOn": sorted({reference[d] for d in node["dependencies"]})}
        for node in sorted(metadata["resolve"]["nodes"], key=lambda node: reference[node["id"]])
    ]
    bom = {"bomFormat": "CycloneDX", "specVersion": "1.5", "version": 1}
    json.dump(bom | {"components": components, "dependencies": dependencies}, sys.stdout, indent=1)


main()
