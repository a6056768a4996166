"""The messages between the page and the server: text to commands, values to text.

A page's message is a JSON object with a "type" and, if it wants an answer, a "request" number. `docs/make_page_types.py`
writes the types as TypeScript; `static/messages.d.ts` holds its output, and a test compares the two.
"""
