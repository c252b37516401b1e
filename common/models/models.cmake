# Build rules of plants, autopilots and laws. Each kind has a folder with a registry, a file
# KINDs.def that names the models, one on each line, and a folder for each model.
#
# sls_add_models(KIND SOURCES …): in the folder of the kind. Makes sls_KIND_keys, which sls::models
# registers, and sls_KINDs, for the programs that fly or control.
function(sls_add_models kind)
  add_library(sls_${kind}_keys STATIC)
  add_library(sls::${kind}_keys ALIAS sls_${kind}_keys)
  target_link_libraries(sls_${kind}_keys PUBLIC sls::config)
  target_compile_options(sls_${kind}_keys PRIVATE ${SLS_COLD})
  cmake_parse_arguments(MODELS "" "" "SOURCES" ${ARGN})
  add_library(sls_${kind}s STATIC ${MODELS_SOURCES})
  add_library(sls::${kind}s ALIAS sls_${kind}s)
  target_link_libraries(sls_${kind}s PUBLIC sls::config sls::model sls::${kind}_keys)
endfunction()

# sls_add_model(KIND MODEL KEYS … SOURCES … [LIBRARIES …]): there, for each model; the sources are in the folder MODEL.
# KIND is plant, autopilot or law.
function(sls_add_model kind model)
  cmake_parse_arguments(MODEL "" "" "KEYS;SOURCES;LIBRARIES" ${ARGN})
  list(TRANSFORM MODEL_KEYS PREPEND ${model}/)
  list(TRANSFORM MODEL_SOURCES PREPEND ${model}/)
  target_sources(sls_${kind}_keys PRIVATE ${MODEL_KEYS})
  target_sources(sls_${kind}s PRIVATE ${MODEL_SOURCES})
  target_link_libraries(sls_${kind}s PRIVATE ${MODEL_LIBRARIES})
endfunction()
