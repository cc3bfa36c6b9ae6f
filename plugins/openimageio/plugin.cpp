// The symbols that OpenImageIO looks up in solidtex.imageio.so.
#include <OpenImageIO/imageio.h>

#include "plugins/openimageio/input.h"

OIIO_PLUGIN_EXPORTS_BEGIN

OIIO_EXPORT int solidtex_imageio_version = OIIO_PLUGIN_VERSION;

OIIO_EXPORT const char* solidtex_imageio_library_version() { return solidtex_version(); }

OIIO_EXPORT OIIO::ImageInput* solidtex_input_imageio_create() {
  return new solidtex::openimageio::Input;
}

OIIO_EXPORT const char* solidtex_input_extensions[] = {"solidtex", nullptr};

OIIO_PLUGIN_EXPORTS_END
