"""Commands, configuration, plug-in lookup: the only place where everything is put together."""
