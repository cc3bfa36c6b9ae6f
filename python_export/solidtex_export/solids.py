"""`python -m solidtex_export.solids`, the older name of solidtex-solids."""

import sys

from solidtex_export.commands.solids import main

if __name__ == "__main__":
    sys.exit(main())
