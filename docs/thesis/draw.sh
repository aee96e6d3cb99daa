# The pictures in this folder, as tests/test_figures.py holds them to be. To draw them anew, with
# docs/examples/kinetile-thesis installed: sh draw.sh
kinetile draw figure-01.toml --at 1.25 --velocities --out figure-01-before.svg --overwrite
kinetile draw figure-01.toml --at 1.5 --velocities --out figure-01-after.svg --overwrite
kinetile draw figure-03.toml --at 0 --velocities --out figure-03-before.svg --overwrite
kinetile draw figure-03.toml --at 2 --velocities --out figure-03-after.svg --overwrite
kinetile draw figure-04.toml --at 0 --velocities --out figure-04-before.svg --overwrite
kinetile draw figure-04.toml --at 3.46 --velocities --out figure-04-after.svg --overwrite
kinetile draw figure-05.toml --at 1.25 --out figure-05-before.svg --overwrite
kinetile draw figure-05.toml --at 1.5 --out figure-05-after.svg --overwrite
kinetile draw figure-06.toml --at 2 --velocities --out figure-06-before.svg --overwrite
kinetile draw figure-06.toml --at 4.25 --velocities --out figure-06-after.svg --overwrite
kinetile draw figure-07.toml --at 0 --out figure-07.svg --overwrite
kinetile draw figure-08.toml --at 1.75 --out figure-08-before.svg --overwrite
kinetile draw figure-08.toml --at 2.25 --out figure-08-after.svg --overwrite
kinetile draw figure-09.toml --at 1.75 --out figure-09-before.svg --overwrite
kinetile draw figure-09.toml --at 2.25 --out figure-09-after.svg --overwrite
kinetile draw figure-10.toml --at 0 --out figure-10.svg --overwrite
kinetile draw figure-11.toml --at 0 --out figure-11.svg --overwrite
kinetile draw figure-12.toml --at 0 --out figure-12.svg --overwrite
kinetile draw figure-13.toml --at 1.25 --velocities --out figure-13-before.svg --overwrite
kinetile draw figure-13.toml --at 2 --velocities --out figure-13-after.svg --overwrite
kinetile draw figure-14.toml --at 0.75 --velocities --out figure-14-before.svg --overwrite
kinetile draw figure-14.toml --at 1.25 --velocities --out figure-14-after.svg --overwrite
kinetile draw figure-15.toml --at 0.75 --velocities --out figure-15-before.svg --overwrite
kinetile draw figure-15.toml --at 1.25 --velocities --out figure-15-after.svg --overwrite
kinetile draw figure-16.toml --at 0 --out figure-16.svg --overwrite
kinetile draw figure-21.toml --at 0 --velocities --out figure-21.svg --overwrite
kinetile draw figure-22.toml --at 1.75 --velocities --out figure-22-before.svg --overwrite
kinetile draw figure-22.toml --at 2.25 --velocities --out figure-22-after.svg --overwrite
kinetile draw meeting.toml --at 1.125 --velocities --broad-phase sweep-tiling --out meeting-right.svg --overwrite
kinetile draw meeting.toml --at 1.125 --velocities --broad-phase tiling-as-written --out meeting-as-written.svg --overwrite
kinetile draw meeting.toml --at 2.25 --velocities --broad-phase tiling-as-written --out meeting-after.svg --overwrite
