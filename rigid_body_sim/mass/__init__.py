"""Where mass properties come from: shapes, meshes, densities, assemblies."""
