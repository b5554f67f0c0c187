# `cmake --install` puts the program, the library, its headers and the package file that find_package(nacre) reads.
include(CMakePackageConfigHelpers)
set(NACRE_PACKAGE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/nacre)

install(TARGETS nacre EXPORT nacreTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(TARGETS nacre_program RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(DIRECTORY include/nacre DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(FILES ${CMAKE_BINARY_DIR}/include/nacre/base/version.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/nacre/base)
install(EXPORT nacreTargets NAMESPACE nacre:: DESTINATION ${NACRE_PACKAGE_DIR})
configure_package_config_file(cmake/nacreConfig.cmake.in ${CMAKE_BINARY_DIR}/nacreConfig.cmake
                              INSTALL_DESTINATION ${NACRE_PACKAGE_DIR})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/nacreConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/nacreConfig.cmake ${CMAKE_BINARY_DIR}/nacreConfigVersion.cmake
        DESTINATION ${NACRE_PACKAGE_DIR})
