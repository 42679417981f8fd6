"""The window of render mode "human": Gymnasium's `HumanRendering`, which uses pygame."""

from typing import Any

import gymnasium
import numpy as np
from gymnasium.wrappers import HumanRendering

from motionenv.errors import EngineError


class _Screen(gymnasium.Env):
    """An environment whose rendering is the image passed as its last action."""

    render_mode = "rgb_array"

    def __init__(self, fps: int):
        self.metadata = {"render_modes": ["rgb_array"], "render_fps": fps}

    def step(self, action: np.ndarray) -> tuple[None, float, bool, bool, dict[str, Any]]:
        self._picture = action
        return None, 0.0, False, False, {}

    def render(self) -> np.ndarray:
        return self._picture


class Window(HumanRendering):
    """A window with at most `fps` frames per second; each `step` shows an image in it."""

    def __init__(self, fps: int) -> None:
        super().__init__(_Screen(fps))

    def step(self, action: np.ndarray) -> tuple:
        """Show an image: `action`, uint8 (H, W, 3).

        Raises:
            DependencyNotInstalled: pygame is missing.
            EngineError: no window can be opened.
        """
        try:
            return super().step(action)
        except RuntimeError as error:  # pygame.error is one
            raise EngineError(
                f'render_mode="human" has no window to open ({error}): without a display, use render_mode="rgb_array" '
                "or set SDL_VIDEODRIVER=dummy"
            ) from None
