"""Figures 4, 5 and 6 and table 2 of Alanov et al. 2019, of a training on photographs.

benchmarks/alanov_textures.py RESULT PHOTOS.csv --folder PHOTOGRAPHS -o FOLDER [--resolution N]

RESULT is a folder of `solidtex-train-space --preset alanov-space` with two numbers a code, PHOTOS
and --resolution are those of its training. FOLDER gets

samples.jpg        each photograph, reproductions of it, and samples of the prior's codes (figure 4)
manifold.jpg       samples of a grid of codes, of the same noise (figure 6)
interpolation.jpg  samples whose code changes from left to right between two photographs (no figure
                   of the paper; codes of positions are those of appendix C)
scores.csv         Inception scores (equation 9), and textures that the samples miss (table 2,
                   figure 5), by a classifier that is trained on crops of the photographs

Of a training on one photograph of several textures (algorithm 1), the rows are random crops with
their own codes, and there are no scores.
"""

from __future__ import annotations

import argparse
import csv
import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as F
from torch import Tensor, nn

from solidtex_export.generators.regions import Box
from solidtex_export.images.exemplar import save_image
from solidtex_export.images.sheet import sheet_of_rows
from solidtex_export.spaces.alanov.materials import Texture, load_textures, random_crop
from solidtex_export.spaces.alanov.networks import KERNELS, PADDINGS, Generator, positions
from solidtex_export.spaces.alanov.result import AlanovResult, read_alanov

REPRODUCTIONS, SAMPLES = 3, 4  # in a row of the figure
CROPS = 12  # of one photograph
RANGE, STEP = 2.25, 0.225  # of the grid of codes, as in figure 6
PARTS = 10  # of the samples, whose scores give the deviation
RARE = 0.1  # a texture is missing below this part of its share of the samples
CERTAIN = 0.98  # mean probability of a crop's own texture; training of the classifier ends here


class Classifier(nn.Sequential):
    """The convolutions of D_psi, with a logit for each texture."""

    def __init__(self, widths: Sequence[int], slope: float, labels: int) -> None:
        super().__init__()
        for inputs, outputs in itertools.pairwise((3, *widths)):
            self.append(nn.Conv2d(inputs, outputs, KERNELS[2], 2, PADDINGS[2]))
            self.extend([nn.BatchNorm2d(outputs), nn.LeakyReLU(slope)])
        self.extend([nn.AdaptiveAvgPool2d(1), nn.Flatten(), nn.Linear(widths[-1], labels)])


def crops_of(textures: Sequence[Texture], labels: Tensor, size: int) -> Tensor:
    return torch.stack([random_crop(textures[i].values, size) for i in labels.tolist()])


def train_classifier(
    textures: Sequence[Texture], widths: Sequence[int], slope: float, size: int, most_steps: int
) -> tuple[Classifier, float]:
    """A classifier, and its accuracy on 32 crops of each texture."""
    classifier = Classifier(widths, slope, len(textures))
    adam = torch.optim.Adam(classifier.parameters(), 1e-3)
    every = torch.arange(len(textures)).repeat(32)
    accuracy = 0.0
    for step in range(1, most_steps + 1):
        labels = torch.randint(len(textures), (32,))
        loss = F.cross_entropy(classifier(crops_of(textures, labels, size)), labels)
        adam.zero_grad()
        loss.backward()
        adam.step()
        if step % 100 == 0 or step == most_steps:
            classifier.eval()
            shares = probabilities(classifier, crops_of(textures, every, size))
            accuracy = float((shares.argmax(1) == every).float().mean())
            certainty = float(shares.gather(1, every[:, None]).mean())
            print(f"classifier: step {step}, accuracy {accuracy:.3f}, certain {certainty:.3f}")
            if certainty >= CERTAIN:
                break
            classifier.train()
    return classifier.eval(), accuracy


@torch.no_grad()
def probabilities(classifier: Classifier, images: Tensor) -> Tensor:
    """p(t | x) [image, texture]."""
    return torch.cat([classifier(part).softmax(1) for part in images.split(64)])


def inception_score(shares: Tensor) -> float:
    """Equation 9 of p(t | x) [image, texture]."""
    divergence = F.kl_div(shares.mean(0).log().expand_as(shares), shares, reduction="batchmean")
    return float(divergence.exp())


def score(shares: Tensor) -> list[float]:
    """Inception score, its deviation over parts, and how many textures the samples miss."""
    parts = [inception_score(part) for part in shares[torch.randperm(len(shares))].chunk(PARTS)]
    counts = torch.bincount(shares.argmax(1), minlength=shares.shape[1])
    missing = int((counts < RARE * len(shares) / shares.shape[1]).sum())
    return [inception_score(shares), float(np.std(parts)), missing]


@torch.no_grad()
def samples(generator: Generator, codes: Tensor, size: int) -> Tensor:
    """A sample [code, 3, row, column] of each code, at random places of the noise."""
    parts = [generator(part, generator.random_box(size)) for part in codes.split(16)]
    return torch.cat(parts)


@torch.no_grad()
def crops_and_codes(
    result: AlanovResult, textures: Sequence[Texture], size: int
) -> tuple[Tensor, Tensor]:
    """A crop of each photograph and its material's code, or crops of the only one."""
    if len(textures) > 1:
        return crops_of(textures, torch.arange(len(textures)), size), result.codes
    crops = crops_of(textures, torch.zeros(CROPS, dtype=torch.long), size)
    return crops, result.encoder(crops)[0]


def figure_4(result: AlanovResult, crops: Tensor, codes: Tensor) -> Tensor:
    rows, size = [], crops.shape[-1]
    for crop, code in zip(crops, codes, strict=True):
        reproduced = samples(result.generator, code.expand(REPRODUCTIONS, -1), size)
        prior = torch.randn(SAMPLES, len(code))
        rows += [crop, *reproduced]
        rows += list(samples(result.generator, prior, size))
    return sheet_of_rows([0.5 + 0.5 * image for image in rows], 1 + REPRODUCTIONS + SAMPLES)


@torch.no_grad()
def manifold(generator: Generator, size: int) -> Tensor:
    """Samples of codes on a grid: z_1 to the right, z_2 upwards."""
    values = torch.arange(-RANGE, RANGE + STEP / 2, STEP)
    box = Box((0, 0), (size, size))
    images = []
    for second in values.flip(0):
        codes = torch.stack([values, second.expand_as(values)], dim=1)
        torch.manual_seed(0)  # the same noise in each row
        images.append(torch.cat(list(generator(codes, box)), dim=2))
    return 0.5 + 0.5 * torch.cat(images, dim=1)


@torch.no_grad()
def interpolation(
    generator: Generator, first: Tensor, last: Tensor, rows: int, columns: int
) -> Tensor:
    """One sample [3, rows, columns] whose code changes linearly from left to right.

    The frequencies follow the code at every position; the phases are 0, as in appendix C.
    """
    box = Box((0, 0), (rows, columns))
    noise_box = generator.boxes(box)[0]
    sizes = noise_box.size
    share = torch.linspace(0, 1, sizes[1])[None, :, None]
    codes = ((1 - share) * first + share * last).expand(sizes[0], -1, -1)
    noise = [codes.permute(2, 0, 1), torch.randn(generator.recipe.noise.local, *sizes)]
    if generator.recipe.noise.periodic:
        frequencies = generator.angular_frequencies(codes.flatten(0, 1)).unflatten(0, sizes)
        places = positions(noise_box, codes.device)
        noise.append(torch.einsum("ijka,aij->kij", frequencies, places).sin())
    return generator.from_noise(torch.cat(noise)[None], box)[0]


def interpolations(result: AlanovResult, codes: Tensor, size: int) -> Tensor:
    """Strips between about six of the codes, in the order of their first number."""
    ordered = codes[codes[:, 0].argsort()]
    rows = [
        0.5 + 0.5 * interpolation(result.generator, first, last, size, 6 * size)
        for first, last in itertools.pairwise(ordered[:: max(1, len(ordered) // 6)])
    ]
    return sheet_of_rows(rows, 1)


def write_scores(
    path: Path, result: AlanovResult, textures: Sequence[Texture], args: argparse.Namespace
) -> None:
    recipe, size = result.recipe, result.recipe.crops.size
    networks = recipe.networks
    classifier, accuracy = train_classifier(
        textures, networks.patches, networks.slope, size, args.classifier_steps
    )
    labels = torch.arange(len(textures)).repeat(args.samples)
    sets = {
        "photographs": crops_of(textures, labels, size),
        "unconditional": samples(result.generator, torch.randn(len(labels), recipe.code), size),
        "conditional": samples(result.generator, result.codes[labels], size),
    }
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        head = ["images", "score", "deviation", "missing textures", "recognized", "count"]
        writer.writerow(head)
        for kind, images in sets.items():
            shares = probabilities(classifier, images)
            value, deviation, missing = score(shares)
            right = float((shares.argmax(1) == labels).float().mean())
            recognized = "" if kind == "unconditional" else f"{right:.3f}"
            row = [kind, f"{value:.2f}", f"{deviation:.2f}", missing, recognized, len(labels)]
            writer.writerow(row)
            print(*map(str, row), sep=", ")
    print(f"{path}: accuracy of the classifier {accuracy:.3f}, at most {len(textures)}")


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("result", type=Path, metavar="RESULT")
    parser.add_argument("photos", type=Path, metavar="PHOTOS", nargs="+")
    parser.add_argument("-o", dest="output", type=Path, metavar="FOLDER", required=True)
    parser.add_argument("--folder", type=Path, help="folder of the files of a CSV")
    parser.add_argument("--resolution", type=int, default=256, metavar="N",
                        help="that of the training (default: 256)")  # fmt: skip
    parser.add_argument("--samples", type=int, default=100, metavar="N",
                        help="samples for each texture (default: 100)")  # fmt: skip
    parser.add_argument("--classifier-steps", type=int, default=3000, metavar="N",
                        help="at most so many (default: 3000)")  # fmt: skip
    args = parser.parse_args(arguments)
    torch.set_num_threads(1)
    torch.manual_seed(0)
    result = read_alanov(args.result)
    if result.recipe.dimensions != 2:
        parser.error(f"{args.result}: found a training on volumes, expected one on photographs")
    result.measure()
    textures = load_textures(args.photos, args.folder, args.resolution, result.recipe)
    if [t.sha256 for t in textures] != [r["sha256"] for r in result.photographs]:
        parser.error(f"PHOTOS: found other photographs than those of {args.result}")
    args.output.mkdir(parents=True, exist_ok=True)
    size = result.recipe.crops.size
    crops, codes = crops_and_codes(result, textures, size)
    figures = {"samples": figure_4(result, crops, codes)}
    if result.recipe.code == 2:
        figures["manifold"] = manifold(result.generator, size // 2)
    figures["interpolation"] = interpolations(result, codes, size)
    for name, image in figures.items():
        save_image(image, args.output / f"{name}.jpg")
        print(args.output / f"{name}.jpg")
    if len(textures) > 1:
        write_scores(args.output / "scores.csv", result, textures, args)


if __name__ == "__main__":
    main()
