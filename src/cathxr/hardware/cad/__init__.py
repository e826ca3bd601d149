"""The parts as solids. The only modules that import the CAD kernel (extra `cad`): import them when they are needed."""
