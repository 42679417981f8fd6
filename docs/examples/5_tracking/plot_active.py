"""
Where should the camera look?
=============================

In ActiveTracking, several people walk about a plaza among pillars, and the agent steers the only camera, which sees at
most a ninth of the plaza, and next to nothing while it turns fast. It must state where everybody is, and how sure it is
of that.

All agents here have the same estimator, a particle filter for each person, and differ in where they look.
"""

import colorsys

import gymnasium
import matplotlib.pyplot as plt
import numpy as np

import motionenv.envs
from motionenv.envs.active import Greedy, Planner, Still, Sweep

gymnasium.register_envs(motionenv.envs)

SECONDS = 30
env = gymnasium.make("motionenv/ActiveTracking-v1", render_mode="rgb_array")


def episode(make):
    """Rewards, standard deviations [m], pictures and the roster of an episode."""
    observation, _ = env.reset(seed=4)
    agent = make(env)
    agent.reset(observation)
    rewards, spreads, pictures = [], [], []
    for _ in range(10 * SECONDS):
        observation, reward, *_ = env.step(agent.act(observation))
        rewards.append(reward)
        spreads.append(agent.beliefs.sigmas[0].copy())
        pictures.append(env.render())
    return np.array(rewards), np.array(spreads), pictures, observation["roster"]


for make in (Still, Sweep, Greedy):
    rewards, *_ = episode(make)
    print(f"{make.__name__}: mean reward {rewards.mean():.2f} m")
rewards, spreads, pictures, roster = episode(Planner)
print(f"Planner: mean reward {rewards.mean():.2f} m")

# %%
# Top: the plaza from above at four moments, with the planner's view between the two lines. Dots are people, and rings
# are beliefs, with a radius of two standard deviations. Bottom: the uncertainty about each person falls when the camera
# looks, and grows until it comes back.
#
# The reward is minus a proper score, so agents do best to state what they believe. One episode says little;
# :doc:`/active-tracking` compares the agents on many.

moments = (20, 100, 180, 260)
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
axes["e"].set(xlim=(0, SECONDS), ylim=(0, 8))
