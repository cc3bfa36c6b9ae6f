"""The comparison as a table and as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from peer_cases import CaseResult, Settings
from peer_runtimes import PEERS

ROW = "{:<14} {:>7}  {:<24} {:<14} {:>10} {:>8} {:>7} {:>9}"
HEAD = ("case", "threads", "", "in", "time", "GFLOP/s", "of peak", "solidtex")
EXPLANATION = """
time: of the whole case, the best of all rounds. A peer's is that of one piece times the pieces
needed, and of the sizes tried the best one counts; it gets its noise for free, solidtex computes
it. GFLOP/s: of the direct method, whatever is computed; the peak is that of this run.
solidtex: how many times as fast it is."""
UNITS = ((1, "s"), (1e-3, "ms"), (1e-6, "us"))


def table(results: Sequence[CaseResult], settings: Settings) -> str:
    lines = [f"solidtex: {results[0].solidtex[0].target}"]
    lines += [f"{peer.name}: {peer.version or 'not installed, left out'}" for peer in PEERS]
    lines.append(f"clock: {settings.clock}; rounds: {settings.rounds}{quick_note(settings)}")
    peaks = {result.threads: result.peak_flops for result in results}
    lines += [f"float32 peak, threads {t}: {peak * 1e-9:.0f} GFLOP/s" for t, peak in peaks.items()]
    lines += ["", ROW.format(*HEAD).rstrip()]
    for result in results:
        lines.append(row(result, "solidtex", "", result.seconds, ""))
        for best in result.best():
            ratio = f"{best.seconds / result.seconds:.2f} x"
            piece = result.case.piece_name(best.piece)
            lines.append(row(result, best.peer.name, piece, best.seconds, ratio))
    return "\n".join(lines) + "\n" + EXPLANATION


def quick_note(settings: Settings) -> str:
    return "; quick: sizes and times mean nothing" if settings.quick else ""


def row(result: CaseResult, name: str, piece: str, seconds: float, ratio: str) -> str:
    flops = result.flops / seconds
    rate, part = f"{flops * 1e-9:.0f}", f"{100 * flops / result.peak_flops:.0f} %"
    columns = (result.case.name, result.threads, name, piece, show_seconds(seconds), rate, part)
    return ROW.format(*columns, ratio).rstrip()


def show_seconds(seconds: float) -> str:
    factor, unit = next((u for u in UNITS if seconds >= u[0]), UNITS[-1])
    return f"{seconds / factor:.3g} {unit}"


def document(results: Sequence[CaseResult], settings: Settings) -> dict[str, Any]:
    """The table's results, and the time for each size of pieces."""
    return {
        "clock": settings.clock,
        "rounds": settings.rounds,
        "quick": settings.quick,
        "versions": {peer.name: peer.version for peer in PEERS},
        "cases": [case_document(result) for result in results],
    }


def case_document(result: CaseResult) -> dict[str, Any]:
    return {
        "name": result.case.name,
        "threads": result.threads,
        "target": result.solidtex[0].target,
        "peak_flops": result.peak_flops,
        "direct_flops": result.flops,
        "seconds": result.seconds,
        "peers": {
            best.peer.name: {
                "seconds": best.seconds,
                "ratio": best.seconds / result.seconds,
                "piece": best.piece,
                "seconds_by_piece": {
                    c.piece: c.seconds for c in result.candidates if c.peer is best.peer
                },
            }
            for best in result.best()
        },
    }
