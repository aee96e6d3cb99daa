"""The built-in observables, registered as by any plugin; each is imported when it is selected."""

from kinetile import ObservableSpec, hookimpl


@hookimpl
def kinetile_observables() -> list[ObservableSpec]:
    """Lists the built-in observables."""
    contacts, moments = "kinetile_observables.contacts", "kinetile_observables.moments"
    cells = "kinetile_observables.power_cells"
    return [
        ObservableSpec("pressure", f"{contacts}:Pressure", "by the virial of contacts, and by walls"),
        ObservableSpec("rates", f"{contacts}:Rates", "contacts a unit of time, by kinds"),
        ObservableSpec("energy", f"{moments}:Energy", "kinetic energy"),
        ObservableSpec("momentum", f"{moments}:Momentum", "momentum"),
        ObservableSpec("temperature", f"{moments}:Temperature", "kT, and that of each kind or mass"),
        ObservableSpec("msd", f"{moments}:MeanSquaredDisplacement", "mean squared displacement"),
        ObservableSpec("vacf", f"{moments}:VelocityAutocorrelation", "velocity autocorrelation"),
        ObservableSpec("g", f"{moments}:PairCorrelation", "pair correlation g(r)", aliases=("gr",)),
        ObservableSpec("S", f"{moments}:StructureFactor", "structure factor S(k)", aliases=("sk",)),
        ObservableSpec("psi6", f"{moments}:BondOrder", "order of bonds, six neighbours around one"),
        ObservableSpec("cells", f"{cells}:PowerCells", "free area and neighbours, by power cells"),
        ObservableSpec("flips", f"{cells}:Flips", "changes of neighbours a unit of time, under power"),
    ]
