# Everything nacre links, found once here and again by an installed nacre's package file.
find_package(embree 3 CONFIG REQUIRED)
find_package(OpenMesh CONFIG REQUIRED)
find_package(OpenEXR 3 CONFIG REQUIRED)
find_package(Imath 3 CONFIG REQUIRED)
find_package(TBB CONFIG REQUIRED)
find_package(fmt REQUIRED)
find_package(pugixml REQUIRED)
find_package(nlohmann_json REQUIRED)
