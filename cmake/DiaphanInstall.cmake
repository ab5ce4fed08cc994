# What `cmake --install` puts where: headers, libraries with their CMake package and pkg-config files, the tool, the shader include.
include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/diaphan)
set(components diaphan)
foreach(part image trace render judge)
  if(TARGET diaphan-${part})
    list(APPEND components diaphan-${part})
  endif()
endforeach()

# a library whose target is called X has the export file XTargets.cmake and the pkg-config file X.pc
foreach(library ${components})
  install(TARGETS ${library} EXPORT ${library}Targets
          ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
          LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
  install(EXPORT ${library}Targets NAMESPACE diaphan:: DESTINATION ${package_dir})
  set_target_properties(${library} PROPERTIES VERSION ${PROJECT_VERSION}
                        SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
endforeach()

# shared libraries find each other, and the tool finds them, wherever the tree is put
if(BUILD_SHARED_LIBS)
  set_target_properties(${components} PROPERTIES INSTALL_RPATH "$ORIGIN")
  if(TARGET diaphan-cli)
    set_target_properties(diaphan-cli PROPERTIES INSTALL_RPATH "$ORIGIN/../${CMAKE_INSTALL_LIBDIR}")
  endif()
endif()

# headers of what was built
file(GLOB headers ${PROJECT_SOURCE_DIR}/include/diaphan/*.h)
foreach(part image trace render judge)
  if(NOT TARGET diaphan-${part})
    list(REMOVE_ITEM headers ${PROJECT_SOURCE_DIR}/include/diaphan/${part}.h)
    if(part STREQUAL image)
      list(REMOVE_ITEM headers ${PROJECT_SOURCE_DIR}/include/diaphan/metrics.h)
    elseif(part STREQUAL trace)
      list(REMOVE_ITEM headers ${PROJECT_SOURCE_DIR}/include/diaphan/response_bake.h)
    endif()
  endif()
endforeach()
install(FILES ${headers} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/diaphan)
if(EXISTS ${PROJECT_SOURCE_DIR}/shaders/diaphan.glsl)
  install(FILES ${PROJECT_SOURCE_DIR}/shaders/diaphan.glsl
          DESTINATION ${CMAKE_INSTALL_DATADIR}/diaphan)
endif()
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
if(TARGET diaphan-cli)
  install(TARGETS diaphan-cli RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()

configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/diaphanConfig.cmake.in
                              ${PROJECT_BINARY_DIR}/diaphanConfig.cmake
                              INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/diaphanConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/diaphanConfig.cmake
              ${PROJECT_BINARY_DIR}/diaphanConfigVersion.cmake DESTINATION ${package_dir})

# pkg-config: our own libraries are asked for in the open, since headers include each other; what a static
# archive needs besides has to be public too, a shared library needs it only with --static. The files
# say where they are relative to themselves, so that an installed tree can be moved.
file(RELATIVE_PATH up /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
string(REGEX REPLACE "/$" "" up "${up}")
function(write_pc name description ours others libs)
  set(name ${name})
  if(BUILD_SHARED_LIBS)
    set(requires "Requires: ${ours}\nRequires.private: ${others}")
    set(link "-l${name}\nLibs.private: ${libs}")
  else()
    set(requires "Requires: ${ours} ${others}")
    set(link "-l${name} ${libs}")
  endif()
  configure_file(${PROJECT_SOURCE_DIR}/cmake/diaphan.pc.in ${PROJECT_BINARY_DIR}/${name}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/${name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endfunction()
set(threads "")
if(DPH_THREADS)
  set(threads -pthread)
endif()
write_pc(diaphan "Directional thickness of meshes as spherical harmonics" "" "jansson"
         "-lmeshoptimizer ${threads} -lm")
if(TARGET diaphan-image)
  write_pc(diaphan-image "Pictures for diaphan" "diaphan" "libpng OpenEXR" "-lm")
endif()
if(TARGET diaphan-trace)
  write_pc(diaphan-trace "Rays for diaphan" "diaphan" "" "-lembree3 -lm")
endif()
if(TARGET diaphan-render)
  write_pc(diaphan-render "Drawing for diaphan" "diaphan diaphan-image" "epoxy egl" "-lm")
endif()
if(TARGET diaphan-judge)
  write_pc(diaphan-judge "Comparisons for diaphan" "diaphan diaphan-image diaphan-trace diaphan-render" ""
           "-lm")
endif()
