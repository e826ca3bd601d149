"""Make the atlas that the segmentation starts from: `python tools/heart_atlas.py STL_FOLDER`."""

import sys
from pathlib import Path

from cathxr.heart.segmentation.atlas import make_atlas

if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("Give the folder of the real heart's STL surfaces and caps.json.")
    target = Path(__file__).resolve().parent.parent / "src" / "cathxr" / "heart" / "segmentation" / "atlas.npz"
    make_atlas(Path(sys.argv[1]), target)
    print(f"{target.name}: {target.stat().st_size / 1024:.0f} kB")
