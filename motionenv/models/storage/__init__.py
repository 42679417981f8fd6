"""Model files: one NPZ format for every model, loaded without executing code."""

from motionenv.models.storage.model_file import StoredModel, load_model, open_model, save_model

__all__ = ["StoredModel", "load_model", "open_model", "save_model"]
