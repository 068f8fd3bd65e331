"""The set of exact cases."""

import functools

from compare.bench import one_contact, two_contacts
from compare.bench.case import Case


@functools.cache
def cases() -> tuple[Case, ...]:
    """All of them: those with one contact first."""
    return (*one_contact.cases(), *two_contacts.cases())
