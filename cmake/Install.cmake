# `cmake --install` installs the library, headers, program, man pages, completions and documents. Other projects find them as the CMake
# package facetree (target facetree::facetree) or as facetree of pkg-config.
include(CMakePackageConfigHelpers)

install(TARGETS facetree EXPORT facetreeTargets
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
    INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(DIRECTORY include/facetree DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.h" PATTERN "*.hpp")
install(FILES README.md CHANGELOG.md LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR}/docs)
install(DIRECTORY examples/ DESTINATION ${CMAKE_INSTALL_DOCDIR}/examples)

if(TARGET facetree_program)
    # The program looks for the library relative to itself, so both may be moved together.
    file(RELATIVE_PATH from_program ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR})
    set_target_properties(facetree_program PROPERTIES INSTALL_RPATH "$ORIGIN/${from_program}")
    install(TARGETS facetree_program RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
    install(FILES ${PROJECT_BINARY_DIR}/completion/bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions
        RENAME facetree)
    install(FILES ${PROJECT_BINARY_DIR}/completion/zsh DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions
        RENAME _facetree)
    install(DIRECTORY ${PROJECT_BINARY_DIR}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR} FILES_MATCHING PATTERN "*.1")
endif()

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/facetree)
install(EXPORT facetreeTargets NAMESPACE facetree:: DESTINATION ${package})
configure_package_config_file(cmake/facetreeConfig.cmake.in ${PROJECT_BINARY_DIR}/cmake/facetreeConfig.cmake
    INSTALL_DESTINATION ${package})
# Before 1.0, a minor version may be incompatible with an earlier one.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/cmake/facetreeConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/cmake/facetreeConfig.cmake ${PROJECT_BINARY_DIR}/cmake/facetreeConfigVersion.cmake
    DESTINATION ${package})

# pkg-config derives the prefix from the place of its file, so an installed tree may be moved.
file(RELATIVE_PATH FACETREE_PC_PREFIX ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
configure_file(cmake/facetree.pc.in ${PROJECT_BINARY_DIR}/cmake/facetree.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/cmake/facetree.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
