"""Methods in steps: the discrete baseline, two engines, and the chart that holds them against the kernel."""
