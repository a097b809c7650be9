# Kernel files (base/variant.h) are compiled twice: for the baseline with their folder, and for AVX2 as a separate target.
set(FACETREE_AVX2_OPTIONS -mavx2 -mbmi -mbmi2) # base/variant.c asks the processor for exactly these
if(FACETREE_AVX2)
    include(CheckCSourceCompiles)
    string(REPLACE ";" " " CMAKE_REQUIRED_FLAGS "${FACETREE_AVX2_OPTIONS}")
    check_c_source_compiles("
        #include <immintrin.h>
        #ifndef __x86_64__
        #error another architecture
        #endif
        int main(void) { __builtin_cpu_init(); return !__builtin_cpu_supports(\"avx2\"); }" FACETREE_AVX2_COMPILES)
    unset(CMAKE_REQUIRED_FLAGS)
    if(NOT FACETREE_AVX2_COMPILES)
        set(FACETREE_AVX2 OFF)
    endif()
endif()

# Sets `result` to the kernel files among the sources and marks them for the compiler.
function(facetree_find_kernels result)
    set(kernels)
    foreach(source IN LISTS ARGN)
        file(STRINGS ${source} marks REGEX "^#include \"base/math/simd(_d8)?\\.h\"")
        if(marks)
            list(APPEND kernels ${source})
            set_source_files_properties(${source} PROPERTIES COMPILE_DEFINITIONS FCT_KERNEL_FILE)
        endif()
    endforeach()
    set(${result} ${kernels} PARENT_SCOPE)
endfunction()

# Compiles a target that consists of kernel files for AVX2.
function(facetree_use_avx2 target)
    target_compile_options(${target} PRIVATE ${FACETREE_AVX2_OPTIONS})
    target_compile_definitions(${target} PRIVATE FCT_VARIANT_AVX2)
endfunction()
