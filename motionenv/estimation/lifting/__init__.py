"""3D walking from 2D points of one camera: paper B's reconstruction (Zhang & Troje 2006), and beyond it."""
