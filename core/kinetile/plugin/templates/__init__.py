"""What ``kinetile new-plugin`` writes into a new package, and what writes it (``new_plugin``).

``phase.txt`` is a broad phase that works as it stands; it is copied with the name of its class changed. The
texts have ``$name``, ``$package`` and ``$distribution`` in them where the plugin's names stand.
"""
