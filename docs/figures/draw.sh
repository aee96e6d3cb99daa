# The pictures in this folder, as tests/test_figures.py holds them to be; to draw them anew: sh draw.sh
kinetile draw random -s bodies=24 -s density=0.3 -s radius_ratio=4 -s seed=4 --at 0.15 --broad-phase sweep-tiling --out sweep-tiling.svg --overwrite
kinetile draw random -s bodies=24 -s density=0.3 -s radius_ratio=4 -s seed=4 --at 0.15 --broad-phase sap-1d --out sap-1d.svg --overwrite
kinetile draw random -s bodies=24 -s density=0.3 -s radius_ratio=4 -s seed=4 --at 0.15 --broad-phase sap-2d --out sap-2d.svg --overwrite
kinetile draw random -s bodies=24 -s density=0.3 -s radius_ratio=4 -s seed=4 --at 0.15 --broad-phase cells --roles cell --velocities --out cells.svg --overwrite
kinetile draw random -s bodies=6 -s density=0.12 -s seed=3 --space-time x --until 1.2 --out space-time.svg --overwrite
python moving.py moving.svg
