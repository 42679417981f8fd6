"""
Where should the camera look?
=============================

In ActiveTracking, several people walk about a plaza among pillars, and the agent steers the only camera, which sees at
most a sixth of the plaza. It must state where everybody is, and how sure it is of that.

To show the trade-off, this agent pans at a constant rate and cheats: it knows the true place of everybody between the
edges of its view. The uncertainty about everybody else grows by 1 m per second.
"""

import colorsys

import gymnasium
import matplotlib.pyplot as plt
import numpy as np

import motionenv.envs

gymnasium.register_envs(motionenv.envs)

SECONDS, HALF_VIEW = 12, np.radians(30)
env = gymnasium.make("motionenv/ActiveTracking-v1", people=3, render_mode="rgb_array")


def episode(pan: float):
    """Rewards, standard deviations [m], pictures and the roster of an episode."""
    observation, _ = env.reset(seed=4)
    places, spread = np.zeros((3, 2)), np.full(3, 6.5)  # they may be anywhere
    rewards, spreads, pictures = [], [], []
    for _ in range(10 * SECONDS):
        true = env.unwrapped.truth()["positions"]
        away = np.arctan2(true[:, 1], true[:, 0]) - observation["camera"][0]
        seen = np.cos(away) > np.cos(HALF_VIEW)
        places[seen] = true[seen]
        spread = np.where(seen, 0.1, np.minimum(spread + 0.1, 6.5))
        beliefs = np.column_stack([places, spread])
        commands = (pan, 0.0, 0.0)  # pan, tilt, zoom
        action = np.concatenate([commands, beliefs.ravel()])
        observation, reward, *_ = env.step(env.unwrapped.action(action))
        rewards.append(reward)
        spreads.append(spread)
        pictures.append(env.render())
    return np.array(rewards), np.array(spreads), pictures, observation["roster"]


for pan in (0.0, 0.25, 0.5, 1.0):
    rewards, *_ = episode(pan)
    print(f"pan at {pan:.0%} of the highest rate: mean reward {rewards.mean():.2f} m")

# %%
# Top: the plaza from above at four moments, with the camera's view between the two lines. Dots are people, and rings
# are beliefs, with a radius of two standard deviations. Bottom: the uncertainty about each person falls when the view
# sweeps over them, and grows until it comes back.
#
# The reward is minus a proper score, so agents do best to state what they believe. Real agents can't cheat: detections
# carry no names, and people must be told apart by place and colour. :doc:`/active-tracking` compares policies.

_, spreads, pictures, roster = episode(pan=0.5)
moments = (10, 40, 70, 100)
figure = plt.figure(figsize=(9, 4.6), layout="constrained")
axes = figure.subplot_mosaic("abcd;eeee", height_ratios=(1.6, 1))
for axis, i in zip("abcd", moments, strict=True):
    axes[axis].imshow(pictures[i][:, :360])  # the map, without the camera's view
    axes[axis].set_title(f"{i / 10:g} s", fontsize="medium")
    axes[axis].axis("off")
for person, (_, cos, sin) in enumerate(roster):
    colour = colorsys.hsv_to_rgb(np.arctan2(sin, cos) / (2 * np.pi) % 1, 0.75, 0.85)
    axes["e"].plot(np.arange(len(spreads)) / 10, spreads[:, person], color=colour)
axes["e"].set(xlabel="time [s]", ylabel="standard deviation [m]")
axes["e"].set(xlim=(0, SECONDS), ylim=(0, 7))
