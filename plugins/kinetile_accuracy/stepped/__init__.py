"""Methods in steps: the discrete baseline, two engines, and the chart that compares them with the kernel."""
