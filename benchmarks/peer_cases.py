"""The measured cases: solidtex and all peers take turns, round after round."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from onnx import ModelProto
from peer_runtimes import PEERS, Inputs, Peer, Work
from solidtex_side import BenchResult, run_case
from timing import seconds_of_calls

from solidtex_export.export.file_format.model_file import ModelFile
from solidtex_export.export.onnx.model import onnx_model
from solidtex_export.generators.lattice import Box


@dataclass(frozen=True)
class Case:
    """A case of solidtex-bench; peers split it into pieces of a size that they choose."""

    name: str
    family: str
    edge: int
    """Edge of the cube of voxels, or number of points."""
    pieces: tuple[int, ...]
    quick_pieces: tuple[int, ...]
    parallel: bool = False

    def units(self, edge: int) -> int:
        """Number of voxels or points."""
        return edge**3 if self.family == "lattice" else edge

    def piece_name(self, piece: int) -> str:
        return f"{piece}^3 blocks" if self.family == "lattice" else f"{piece} points"


CASES = {
    case.name: case
    for case in (
        Case("lattice.256", "lattice", 256, (32, 64, 128), (8, 12), parallel=True),
        Case("lattice.32", "lattice", 32, (32,), (8,)),
        Case("sampler.batch", "sampler", 4096, (512, 1024, 4096), (16, 64)),
    )
}


@dataclass(frozen=True)
class Settings:
    bench: Path
    models: dict[str, ModelFile]
    """Models by family."""
    bench_options: list[str]
    threads: int
    rounds: int
    seconds: float
    clock: str
    quick: bool


@dataclass
class Candidate:
    """One peer with one size of pieces."""

    peer: Peer
    piece: int
    pieces: float
    """Number of pieces in the case."""
    work: Work
    piece_seconds: list[float] = field(default_factory=list)

    @property
    def seconds(self) -> float:
        """Seconds for the whole case."""
        return min(self.piece_seconds) * self.pieces


@dataclass
class CaseResult:
    case: Case
    threads: int
    solidtex: list[BenchResult]
    candidates: list[Candidate]

    @property
    def seconds(self) -> float:
        """Seconds of solidtex."""
        units = self.case.units(self.case.edge)
        return min(result.seconds_per_unit for result in self.solidtex) * units

    @property
    def peak_flops(self) -> float:
        return max(result.peak_flops for result in self.solidtex)

    @property
    def flops(self) -> float:
        """Floating-point operations of direct convolution for the whole case."""
        units = self.case.units(self.case.edge)
        return 2 * self.solidtex[0].multiply_adds_per_unit * units

    def best(self) -> list[Candidate]:
        """The fastest size of pieces of each peer."""
        names = dict.fromkeys(candidate.peer.name for candidate in self.candidates)
        return [
            min((c for c in self.candidates if c.peer.name == name), key=lambda c: c.seconds)
            for name in names
        ]


def measure_case(case: Case, settings: Settings) -> CaseResult:
    threads = settings.threads if case.parallel else 1
    result = CaseResult(case, threads, [], [])
    print(f"{case.name}: preparing", file=sys.stderr)
    result.candidates.extend(candidates(case, settings, threads))
    for round_ in range(settings.rounds):
        print(f"{case.name}: round {round_ + 1} of {settings.rounds}", file=sys.stderr)
        result.solidtex.append(run_case(settings.bench, case.name, threads, settings.bench_options))
        for candidate in result.candidates:
            candidate.piece_seconds.extend(
                seconds_of_calls(candidate.work, settings.seconds, settings.clock, threads)
            )
    return result


def candidates(case: Case, settings: Settings, threads: int) -> Iterator[Candidate]:
    """Candidates of all installed peers, each warmed up by a call."""
    for piece in case.quick_pieces if settings.quick else case.pieces:
        box = Box((0,) * 3, (piece,) * 3) if case.family == "lattice" else None
        model = onnx_model(settings.models[case.family], box)
        inputs = random_inputs(model, piece)
        for peer in PEERS:
            if peer.version is None or case.family not in peer.families:
                continue
            work = peer.load(model, inputs, threads)
            work()
            yield Candidate(peer, piece, case.units(case.edge) / case.units(piece), work)


def random_inputs(model: ModelProto, points: int) -> Inputs:
    """Noise inputs of the peers, which are not timed; dynamic dimensions are `points`."""
    rng = np.random.default_rng(0)
    inputs = {}
    for value in model.graph.input:
        shape = [d.dim_value or points for d in value.type.tensor_type.shape.dim]
        draw = rng.random if len(shape) == 5 else rng.standard_normal
        inputs[value.name] = draw(shape, dtype=np.float32)
    return inputs
