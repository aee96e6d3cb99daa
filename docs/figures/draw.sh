# The pictures in this folder, as tests/test_figures.py holds them to be; to draw them anew: sh draw.sh
# (with tests/foreign/kinetile-stripes installed, for the picture of its phase)
kinetile draw random -s bodies=24 -s density=0.3 -s radius_ratio=4 -s seed=4 --at 0.15 --broad-phase sweep-tiling --out sweep-tiling.svg --overwrite
kinetile draw random -s bodies=24 -s density=0.3 -s radius_ratio=4 -s seed=4 --at 0.15 --broad-phase sap-1d --out sap-1d.svg --overwrite
kinetile draw random -s bodies=24 -s density=0.3 -s radius_ratio=4 -s seed=4 --at 0.15 --broad-phase sap-2d --out sap-2d.svg --overwrite
kinetile draw random -s bodies=24 -s density=0.3 -s radius_ratio=4 -s seed=4 --at 0.15 --broad-phase cells --roles cell --velocities --out cells.svg --overwrite
kinetile draw random -s bodies=6 -s density=0.12 -s seed=3 --space-time x --until 1.2 --out space-time.svg --overwrite
python moving.py moving.svg
python bullet.py bullet.svg
kinetile draw random -s bodies=24 -s density=0.3 -s radius_ratio=4 -s seed=4 --at 0.15 --broad-phase stripes --out stripes.svg --overwrite
kinetile draw grid -s bodies=49 -s seed=1 --roles certificate --velocities --out scene-grid.svg --overwrite
kinetile draw mixture -s bodies=60 -s radii=1,2 -s fractions=.7,.3 -s density=.5 --roles certificate --velocities --out scene-mixture.svg --overwrite
kinetile draw grid -s bodies=36 -s density=0.06 -s seed=1 -s gravity=0,-6 --at 0.8 --broad-phase sweep-tiling --roles tile --velocities --out falling.svg --overwrite
kinetile draw hexagonal -s columns=8 -s rows=8 -s vacancies=3 --roles certificate --velocities --out scene-hexagonal.svg --overwrite
kinetile draw living.toml --space-time x --until 1.25 --out living.svg --overwrite
kinetile draw responses.toml --space-time x --until 4 --out responses.svg --overwrite
python diagrams.py .
