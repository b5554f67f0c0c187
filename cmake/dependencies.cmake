# Everything nacre is built from. What its static library is linked with is listed once, here, and found again
# by an installed nacre's package file.
set(NACRE_LINKED_PACKAGES
  "embree 3 CONFIG" "OpenMesh CONFIG" "OpenEXR 3 CONFIG" "Imath 3 CONFIG" "TBB CONFIG" "hwy CONFIG" "fmt" "pugixml" "ZLIB")
set(NACRE_FIND_DEPENDENCIES "")
# Debian's Imath reports at length that its Python bindings are not installed.
set(CMAKE_MESSAGE_LOG_LEVEL NOTICE)
foreach(package IN LISTS NACRE_LINKED_PACKAGES)
  separate_arguments(arguments UNIX_COMMAND "${package}")
  find_package(${arguments} REQUIRED)
  string(APPEND NACRE_FIND_DEPENDENCIES "find_dependency(${package})\n")
endforeach()
unset(CMAKE_MESSAGE_LOG_LEVEL)

# Headers that no consumer of the library needs.
find_package(nlohmann_json REQUIRED)
find_package(Eigen3 CONFIG REQUIRED)
find_package(CLI11 CONFIG REQUIRED)
