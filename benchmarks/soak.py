"""Loads one texture with queries, and shows that memory is bounded.

mixed   64 threads ask boxes, points, jacobians and footprints of four seeds, with a cache of 1 % of
        the working set. A sample is compared with a serial evaluation, at error 0.
walk    points farther and farther from the origin: no brick is needed twice. Memory must not grow.
limit   mixed, with so much address space (ulimit -v) as an idle run takes and a margin.

The work is done by solidtex_soak (benchmarks/soak.cpp).
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[1]


def main() -> int:
    p = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    p.add_argument("kind", choices=("mixed", "walk", "limit"))
    p.add_argument("--model", default="granite-grey", help="path or name (default granite-grey)")
    p.add_argument("--threads", type=int, default=64, help="of mixed queries (default 64)")
    p.add_argument("--queries", type=int, default=1_000_000, help="of mixed (default 1000000)")
    p.add_argument("--seconds", type=float, default=120, help="of a walk (default 120)")
    p.add_argument("--megabytes", type=int, default=1024, help="of limit (default 1024)")
    p.add_argument("--build", type=Path, default=REPOSITORY / "build")
    args = p.parse_args()
    kind = "walk" if args.kind == "walk" else "mixed"
    command = [args.build / "bin" / "solidtex_soak", kind, args.model]
    command += ["--threads", args.threads, "--queries", args.queries, "--seconds", args.seconds]
    limit = args.megabytes << 20

    def lower_limit() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))

    done = subprocess.run(
        list(map(str, command)),
        stdout=subprocess.PIPE,
        text=True,
        check=False,
        preexec_fn=lower_limit if args.kind == "limit" else None,
    )
    if not done.stdout:
        return done.returncode or 1
    found = json.loads(done.stdout)
    for name, value in found.items():
        print(f"{name}: {value}")
    if kind == "walk":
        print(f"lookups a second: {found['lookups'] / found['seconds']:.0f}")
    return done.returncode


if __name__ == "__main__":
    sys.exit(main())
