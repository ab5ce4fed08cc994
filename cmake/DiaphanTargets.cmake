# What every target of the project has in common, and kernels that are compiled once per processor.

add_library(dph_options INTERFACE)
target_compile_options(dph_options INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wstrict-prototypes -Wmissing-prototypes -Wpointer-arith
  -Wcast-qual -Wundef -Wvla -Wno-psabi
  $<$<BOOL:${DPH_WERROR}>:-Werror>
  # one rounding an operation: the same bytes on every processor
  -ffp-contract=off)
if(DPH_SANITIZE)
  target_compile_options(dph_options INTERFACE -fsanitize=address,undefined
                         -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(dph_options INTERFACE -fsanitize=address,undefined)
endif()
if(DPH_FUZZ)
  target_compile_options(dph_options INTERFACE -fsanitize=fuzzer-no-link)
endif()

if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64|amd64)$")
  set(DPH_HAVE_AVX2 ON)
endif()

# dph_add_kernel(TARGET FILE...): compiles each file as NAME_portable and, on x86-64, NAME_avx2 (see src/core/simd.h)
function(dph_add_kernel target)
  set(variants portable)
  if(DPH_HAVE_AVX2)
    list(APPEND variants avx2)
  endif()
  foreach(file ${ARGN})
    get_filename_component(name ${file} NAME_WE)
    foreach(variant ${variants})
      set(object ${target}_${name}_${variant})
      add_library(${object} OBJECT ${file})
      target_compile_definitions(${object} PRIVATE DPH_KERNEL_SUFFIX=_${variant}
                                 $<$<BOOL:${DPH_HAVE_AVX2}>:DPH_HAVE_AVX2>)
      target_compile_options(${object} PRIVATE -O3 $<$<STREQUAL:${variant},avx2>:-mavx2>)
      target_include_directories(${object} PRIVATE ${PROJECT_SOURCE_DIR}/include
                                 ${PROJECT_SOURCE_DIR}/src)
      target_link_libraries(${object} PRIVATE $<BUILD_INTERFACE:dph_options>)
      target_sources(${target} PRIVATE $<TARGET_OBJECTS:${object}>)
    endforeach()
  endforeach()
endfunction()

# dph_add_library(NAME SOURCE...): one of the project's libraries
function(dph_add_library name)
  add_library(${name} ${ARGN})
  add_library(diaphan::${name} ALIAS ${name})
  target_include_directories(${name}
    PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:include>
    PRIVATE ${PROJECT_SOURCE_DIR}/src)
  target_link_libraries(${name} PRIVATE $<BUILD_INTERFACE:dph_options>)
endfunction()
