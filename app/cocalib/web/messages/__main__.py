"""Print `static/messages.d.ts`."""

from cocalib.web.messages.typescript import declarations

if __name__ == "__main__":
    print(declarations(), end="")
