"""What networks notice in markers, silhouettes and colour images, at a cost that one core can bear.

Where a silhouette is and how large tells where its walker is, so rows, columns, box and a close-up are features of
their own. They were chosen on split "train": after half a minute WalkerTracking-Easy was off by 219 mm with them, and
by 1,308 mm with a convolutional network of four layers, which sees an eighth of the frames in this time;
ArmTracking-Easy by 92 and 261 mm.
"""

import torch
from torch import nn

UNITS = 192
SIZE, CROP = 64, 24  # of images, and of what is looked at closely [pixels]
SOLID = 0.5  # pixels that a row of a silhouette has
UNSURE = 30.0  # difference of a pixel from its mean that noise makes, of 255
_NOWHERE = 0.9  # [m] height of a marker that isn't seen

#: Features (frames, n, size), first guesses of joints that broadcast to (frames, n, joints, 3) [m], what is remembered.
Noticed = tuple[torch.Tensor, torch.Tensor, torch.Tensor | None]


class PointFeatures(nn.Module):
    """Markers (frames, n, 45): positions of those that are seen, and which are.

    Nothing is remembered here: a GRU finds out by itself where markers were, and better. Told of the last positions of
    markers and their ages, it was off by 78 mm after 68 s of MarkerTracking-Medium, and by 59 mm without.
    """

    size, scale = UNITS, 1.0

    def __init__(self):
        super().__init__()
        self.first = nn.Linear(45, UNITS)

    def forward(self, seen: torch.Tensor, before: torch.Tensor | None) -> Noticed:
        """As `Noticed`: what is seen is corrected, what isn't is guessed."""
        points, shown = seen[..., :30].unflatten(-1, (15, 2)), seen[..., 30:]
        high = torch.where(shown > 0, points[..., 1], _NOWHERE)
        guess = torch.stack([points[..., 0], torch.zeros_like(high), high], dim=-1)
        return torch.relu(self.first(seen)), guess, before

    def blank(self, n: int) -> torch.Tensor | None:
        """What is remembered before the first frame."""
        return None


class JointFeatures(nn.Module):
    """True joints (frames, n, 45), of which `scored` are asked for: what a fully observable task shows.

    Args:
        scored: indices of the joints that an action says.
    """

    size, scale = UNITS, 1.0

    def __init__(self, scored: list[int]):
        super().__init__()
        self.first, self.scored = nn.Linear(45, UNITS), scored

    def forward(self, seen: torch.Tensor, before: torch.Tensor | None) -> Noticed:
        """As `Noticed`."""
        return torch.relu(self.first(seen)), seen.unflatten(-1, (15, 3))[..., self.scored, :], before

    def blank(self, n: int) -> torch.Tensor | None:
        """What is remembered before the first frame."""
        return None


class SilhouetteFeatures(nn.Module):
    """Silhouettes (frames, SIZE, SIZE) from 0 to 1: where they are, how large, and what they look like close up."""

    def __init__(self):
        super().__init__()
        self.place = nn.Linear(2 * SIZE + 8, UNITS)
        self.near, self.far = nn.Linear(CROP**2, UNITS), nn.Linear(SIZE**2 // 4, UNITS)
        self.last = nn.Linear(3 * UNITS, UNITS)

    def forward(self, shown: torch.Tensor) -> torch.Tensor:
        """Features (frames, UNITS)."""
        rows, columns, along = shown.sum(-1), shown.sum(-2), torch.arange(float(SIZE))
        area = rows.sum(-1).clamp(min=1.0)
        row, column = rows @ along / area, columns @ along / area
        filled = (rows > SOLID).float()
        top, bottom = filled.argmax(-1).float(), SIZE - 1 - filled.flip(-1).argmax(-1).float()
        inverse = 16.0 / (bottom - top + 1.0).clamp(min=1.0)  # grows with the distance, as what a pixel shows does
        feet, right = 8.0 / (bottom - SIZE / 2).clamp(min=2.0), 2.0 * column / SIZE - 1.0
        box = [2.0 * row / SIZE - 1.0, right, area / SIZE, inverse, right * inverse, feet, right * feet, top / SIZE]
        place = torch.cat([rows / 8.0, columns / 8.0, torch.stack(box, dim=-1)], dim=-1)
        close = cropped(shown, row, column).flatten(1)
        small = nn.functional.avg_pool2d(shown[:, None], 2).flatten(1)
        features = torch.cat([self.place(place), self.near(close), self.far(small)], dim=-1)
        return torch.relu(self.last(torch.relu(features)))


def cropped(pictures: torch.Tensor, row: torch.Tensor, column: torch.Tensor) -> torch.Tensor:
    """Squares of CROP pixels in `pictures` (frames, SIZE, SIZE), about `row` and `column` (frames,)."""
    first = torch.stack([row, column], dim=-1).round().long() - CROP // 2
    which = first.clamp(0, SIZE - CROP)[..., None] + torch.arange(CROP)
    return pictures[torch.arange(len(pictures))[:, None, None], which[:, 0, :, None], which[:, 1, None, :]]


class ColourFeatures(nn.Module):
    """Colour images (frames, 3, SIZE, SIZE) from 0 to 1, by convolution."""

    def __init__(self):
        super().__init__()
        self.look = nn.Sequential(
            nn.Conv2d(3, 12, 4, stride=4), nn.ReLU(),
            nn.Conv2d(12, 24, 3, stride=2, padding=1), nn.ReLU(),
            nn.Flatten(), nn.Linear(24 * (SIZE // 8) ** 2, UNITS), nn.ReLU(),
        )  # fmt: skip

    def forward(self, shown: torch.Tensor) -> torch.Tensor:
        """Features (frames, UNITS)."""
        return self.look(shown)


class PictureFeatures(nn.Module):
    """Images (frames, n, channels, SIZE, SIZE) from 0 to 255: silhouettes, or colours.

    Args:
        colours: whether images are colour images.
        remembers: whether to compare colours with each pixel's mean.
    """

    def __init__(self, colours: bool, remembers: bool):
        super().__init__()
        self.compares = colours and remembers
        self.look = ColourFeatures() if colours else None
        self.silhouette = SilhouetteFeatures() if remembers or not colours else None
        self.scale = 2.0  # [m] of corrections: people are anywhere in the picture
        self.size = UNITS * ((self.look is not None) + (self.silhouette is not None))

    def forward(self, seen: torch.Tensor, before: torch.Tensor | None) -> Noticed:
        """As `Noticed`; what is remembered (n, 4, SIZE, SIZE) are sums of pixels, and frames."""
        features = []
        if self.look is not None:
            features.append(self.look(seen.flatten(0, 1).float() / 255.0))
        if self.silhouette is not None:
            shown, before = moved(seen, before) if self.compares else (seen[:, :, 0].float() / 255.0, None)
            features.append(self.silhouette(shown.flatten(0, 1)))
        return torch.cat(features, dim=-1).unflatten(0, seen.shape[:2]), torch.tensor([0.0, 0.0, _NOWHERE]), before

    def blank(self, n: int) -> torch.Tensor | None:
        """What is remembered before the first frame."""
        return torch.zeros(n, 4, SIZE, SIZE) if self.compares else None


@torch.no_grad()
def moved(seen: torch.Tensor, before: torch.Tensor | None) -> tuple[torch.Tensor, torch.Tensor]:
    """How far images (frames, n, 3, SIZE, SIZE) from 0 to 255 are from each pixel's mean until then, from 0 to 1.

    Also the sums of pixels (n, 4, SIZE, SIZE), the last of which counts; `before` are those of earlier frames.
    """
    sums = torch.zeros(seen.shape[1], 4, SIZE, SIZE) if before is None else before.clone()
    away = torch.empty(len(seen), seen.shape[1], SIZE, SIZE)
    for frame, off in zip(seen, away, strict=True):
        shown = frame.float()
        sums[:, :3] += shown
        sums[:, 3] += 1.0
        torch.amax(shown.sub_(sums[:, :3] / sums[:, 3:]).abs_(), dim=1, out=off)
    return away.sub_(UNSURE).div_(UNSURE).clamp_(0.0, 1.0), sums
